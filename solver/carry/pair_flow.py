"""Points that flow along a surface: each pair draws its own to its goal, and what lies around goes along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from ..surface.barycentric import interpolated, weighted
from ..surface.mesh import Floats, Integers, TriangleMesh, face_neighbours
from ..surface.nearest import nearest_in_triangle

STEEPEST = 2.11
"""Largest slope of `bump` over a reach of 1: at a distance of 1/4, 20 / 4 (3/4)^3."""

SHARE = 0.5
"""Of the step at which a field's differential could turn a triangle over, what one step makes at most."""

STEPS = 400
"""At most; a pair across the whole source takes some 100."""

PATIENCE = 10
"""Steps without gain before it ends: pairs that contradict each other, or a goal beyond a boundary."""

NEAR = 1e-4
"""Share of the reach within which a pair counts as met."""

DETOUR = 1.42
"""Ways along edges are up to so much longer than straight ones on a flat grid, across whose squares they go."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A surface to walk on: what coincides counts as one vertex, so that the seams of a file do not stop anybody."""

    mesh: TriangleMesh
    welded: Integers
    first: Integers
    neighbours: Integers
    graph: csr_array
    normals: Floats

    @staticmethod
    def on(mesh: TriangleMesh) -> Walk:
        """Return a surface made ready for walking."""
        _, first, welded = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
        welded = welded.ravel()
        faces, size = welded[mesh.faces], int(welded.max()) + 1
        ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        own = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
        keys, once = np.unique(np.sort(ends, axis=1) @ np.array([size, 1]), return_index=True)
        length = np.linalg.norm(mesh.vertices[own[once, 0]] - mesh.vertices[own[once, 1]], axis=1)
        graph = coo_array((np.maximum(length, 1e-300), np.divmod(keys, size)), shape=(size, size)).tocsr()
        vectors = mesh.face_vectors
        normals = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
        return Walk(mesh, welded, first, face_neighbours(faces, size), graph, normals)

    def places(self, face: Integers, weights: Floats) -> Floats:
        """Return points in space, (q, 3); nan where there is no face."""
        found = interpolated(self.mesh.vertices, self.mesh.faces[face], weights)
        return np.where((face >= 0)[:, None], found, np.nan)

    def way(self, faces: Integers, weights: Floats, shares: Floats, end: int, goal: Floats) -> Integers | None:
        """Return the vertices, (k,), along edges from a mean of points, (3,), to another; None: no way leads there."""
        heavy = int(np.argmax(shares))
        if (faces[shares > 0] < 0).any():
            return None
        start = self.welded[self.mesh.faces[faces[heavy], np.argmax(weights[heavy])]]
        last = self.welded[self.mesh.faces[end, np.argmax(goal)]]
        length, before = dijkstra(self.graph, directed=False, indices=last, return_predecessors=True)
        if not np.isfinite(length[start]):
            return None
        way = [int(start)]
        while way[-1] != last:
            way.append(int(before[way[-1]]))
        return np.array(way)

    def step(self, face: Integers, weights: Floats, points: Floats) -> tuple[Integers, Floats]:
        """Return the points of the surface, (q,) and (q, 3), nearest to points of space not far from them, (q, 3).

        From face to face: what is near in space and far along the surface, as the other lip, is not found.
        """
        face, weights = face.copy(), weights.copy()
        going = np.arange(len(face))
        for _ in range(20):
            near = self._around(face[going])
            best = np.full(len(going), np.inf)
            chosen, where = face[going].copy(), weights[going].copy()
            for column in near.T:
                corners = self.mesh.vertices[self.mesh.faces[column]]
                here = nearest_in_triangle(points[going], corners)
                off = weighted(corners, here) - points[going]
                distance = np.einsum("qd,qd->q", off, off)
                nearer = distance < best * (1 - 1e-12)
                best[nearer], chosen[nearer], where[nearer] = distance[nearer], column[nearer], here[nearer]
            still = chosen != face[going]
            face[going], weights[going] = chosen, where
            going = going[still]
            if not going.size:
                break
        return face, weights

    def _around(self, face: Integers) -> Integers:
        """Return faces, (q, 10), with those next to them and next to these; themselves where there is none."""
        near = self.neighbours[face]
        near = np.where(near < 0, face[:, None], near)
        beyond = self.neighbours[near].reshape(len(face), 9)
        beyond = np.where(beyond < 0, face[:, None], beyond)
        return np.concatenate([face[:, None], near, beyond], axis=1)


@dataclass(frozen=True, eq=False)
class Flow:
    """What pairs do to points of the source: goals, (l, 3), reaches, (l,), and the way to each along edges."""

    walk: Walk
    goals: Floats
    reach: Floats
    ways: list[Integers]

    def run(self, face: Integers, weights: Floats, corners: Integers, shares: Floats) -> None:
        """Move points of the source, (n,) and (n, 3), in place, until those of the pairs are at their goals.

        A pair's point is the mean of the points of three, `corners`, (l, 3), by `shares`, (l, 3).
        """
        walk, gates = self.walk, self._gates()
        open_face = (gates > 0).any(axis=0)[walk.welded[walk.mesh.faces]].any(axis=1)
        some = np.flatnonzero((face >= 0) & open_face[face])
        fixed = walk.places(face, weights)
        here, inside = face[some], weights[some]
        ahead, best, waited = self._detours(mean_at(fixed, corners, shares)), np.inf, 0
        for _ in range(STEPS):
            now = walk.places(here, inside)
            fixed[some] = now
            centres = mean_at(fixed, corners, shares)
            moves = self._towards(centres, ahead)
            normals = mean_at(walk.normals[face], corners, shares)
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
            moves -= (moves * normals).sum(axis=1, keepdims=True) * normals
            size = np.linalg.norm(moves, axis=1)
            waited = 0 if size.sum() < 0.99 * best else waited + 1
            best = min(best, float(size.sum()))
            if (size <= NEAR * self.reach).all() or waited > PATIENCE:
                break
            strength = np.linalg.lstsq(bump(apart(centres, centres) / self.reach), moves, rcond=1e-3)[0]
            steepest = float((np.linalg.norm(strength, axis=1) * STEEPEST / self.reach).sum())
            field = self._gated(gates, here, inside) * bump(apart(now, centres) / self.reach)
            shift = min(1.0, SHARE / steepest) * (field @ strength)
            moving = np.flatnonzero((shift != 0).any(axis=1))
            onto = now[moving] + shift[moving]
            here[moving], inside[moving] = walk.step(here[moving], inside[moving], onto)
            face[some] = here
        weights[some] = inside

    def _gates(self) -> Floats:
        """Return how open each vertex is to each pair, (l, w): 0 where the way along the surface is long."""
        found = []
        for way, reach in zip(self.ways, self.reach, strict=True):
            far = 2 * DETOUR * reach
            length = dijkstra(self.walk.graph, directed=False, indices=np.unique(way), limit=far, min_only=True)
            t = np.clip((far - length) / (far - DETOUR * reach), 0, 1)
            found.append(np.where(np.isfinite(length), t * t * (3 - 2 * t), 0.0))
        return np.array(found)

    def _gated(self, gates: Floats, face: Integers, weights: Floats) -> Floats:
        """Return the same at points, (q, l)."""
        corners = self.walk.welded[self.walk.mesh.faces[face]]
        return np.einsum("lqk,qk->ql", gates[:, corners], weights)

    def _towards(self, centres: Floats, ahead: list[Floats]) -> Floats:
        """Return where to each pair's point goes next, (l, 3): straight, or by the places of a detour."""
        result = self.goals - centres
        for k, reach in enumerate(self.reach):
            while len(ahead[k]) and np.linalg.norm(ahead[k][0] - centres[k]) < reach / 8:
                ahead[k] = ahead[k][1:]
            if len(ahead[k]):
                result[k] = ahead[k][0] - centres[k]
        return result

    def _detours(self, centres: Floats) -> list[Floats]:
        """Return the places of each way, (k, 3), where it is a detour, as around a mouth; none, (0, 3), elsewhere."""
        found = []
        for way, goal, centre, reach in zip(self.ways, self.goals, centres, self.reach, strict=True):
            places = self.walk.mesh.vertices[self.walk.first[way]]
            long = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
            straight = np.linalg.norm(goal - centre)
            found.append(places if long > DETOUR * straight + reach / 4 else places[:0])
        return found


def mean_at(values: Floats, corners: Integers, shares: Floats) -> Floats:
    """Return means of values at corners, (l, 3), by shares; corners without a share do not count."""
    return (np.where(shares[:, :, None] > 0, values[corners], 0.0) * shares[:, :, None]).sum(axis=1)


def apart(points: Floats, centres: Floats) -> Floats:
    """Return distances, (q, l)."""
    return np.linalg.norm(points[:, None] - centres[None], axis=2)


def bump(distance: Floats) -> Floats:
    """Return 1 at distance 0, smoothly 0 from 1 on: Wendland's function of two derivatives in space (1995)."""
    near = np.clip(1 - distance, 0, 1)
    return near**4 * (4 * distance + 1)
