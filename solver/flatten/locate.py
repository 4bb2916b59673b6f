"""Point location in a triangulated disc or sphere: the triangle that holds a point, and where in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..surface.mesh import Booleans, Complexes, Floats, Integers, Places, face_neighbours, first_corners

AT_ONCE = 4096
"""Queries outside whose nearest face is looked for at a time: some 100 MB of candidates."""


@dataclass(frozen=True, eq=False)
class TriangulatedDisc:
    """A triangulation of the unit disc, prepared for point location.

    Attributes
    ----------
    points : (n,) complex128
        nan where a vertex is in no face.
    faces : (m, 3) int
        Counter-clockwise triangles.
    neighbours : (m, 3) int
        The face across the side opposite each corner; -1 on the boundary.
    """

    points: Places
    faces: Integers
    neighbours: Integers
    _tree: KDTree
    _face_of_leaf: Integers

    @staticmethod
    def of(points: Places, faces: Integers) -> TriangulatedDisc:
        """Prepare the triangulation with these points, (n,), and faces, (m, 3)."""
        used, first = first_corners(faces, len(points))
        tree = KDTree(plane(points[used]))
        return TriangulatedDisc(points, faces, face_neighbours(faces, len(points)), tree, first // 3)

    def locate(self, queries: Places, near: Integers | None = None) -> tuple[Integers, Floats]:
        """Return the face, (q,), that holds each query and the barycentric coordinates, (q, 3), in it.

        A query outside the triangulation (between the circle and the polygon inscribed in it) gets the nearest point of
        the boundary side it lies beyond. `near`: a face not far from each, (q,), where one is known; it saves time.
        """
        face = self._face_of_leaf[self._tree.query(self._coordinates(queries))[1]] if near is None else near.copy()
        inside = np.zeros(len(queries), bool)
        open_queries = np.arange(len(queries))
        previous = np.full(len(queries), -1)
        # a walk across the side that the query lies farthest behind; each step is a step nearer in a convex domain
        for _ in range(4 * int(np.sqrt(len(self.faces))) + 100):
            here = face[open_queries]
            sides = self._side_areas(here, queries[open_queries])
            blocked = (self.neighbours[here] < 0) | (self.neighbours[here] == previous[open_queries, None])
            behind = np.where(blocked, 0.0, sides)
            corner = np.argmin(behind, axis=1)
            done = behind[np.arange(len(here)), corner] >= 0
            inside[open_queries[done]] = True
            moving = open_queries[~done]
            if len(moving) == 0:
                break
            previous[moving] = face[moving]
            face[moving] = self.neighbours[face[moving], corner[~done]]
            open_queries = moving
        weights = self.barycentric(face, queries)
        strays = np.flatnonzero(~inside | (weights.min(axis=1) < -1e-6))
        strays = strays[~self._beyond_own_side(face[strays], queries[strays])]
        if len(strays):
            face[strays] = self._nearest_face(queries[strays])
        outside = np.union1d(strays, np.flatnonzero(weights.min(axis=1) < 0))
        weights[outside] = self._clamped(face[outside], queries[outside])
        return face, weights

    def _beyond_own_side(self, face: Integers, queries: Places) -> Booleans:
        """Return whether each query has its nearest point of the face on a side of the outline, and in no corner.

        Of a convex outline that is the nearest point of all: the line along that side has everything behind it.
        """
        there = self._clamped(face, queries) > 0
        corner = np.argmin(there, axis=1)
        return (there.sum(axis=1) == 2) & (self.neighbours[face, corner] < 0)

    def barycentric(self, face: Integers, queries: Places) -> Floats:
        """Return barycentric coordinates, (q, 3), of queries in given faces; negative outside; thirds without area."""
        sides = self._side_areas(face, queries)
        total = sides.sum(axis=1, keepdims=True)
        return np.divide(sides, total, out=np.full_like(sides, 1 / 3), where=np.abs(total) > 0)

    def _coordinates(self, points: Places) -> Floats:
        """Return what the tree of the vertices holds."""
        return plane(points)

    def _side_areas(self, face: Integers, queries: Places) -> Floats:
        # in rows of their own: numpy multiplies strided complex numbers in one of two ways, by what lies beside them in
        # memory, and these differ in the last bit
        a, b, c = np.ascontiguousarray(self.points[self.faces[face]].T) - queries
        return np.stack([np.imag(np.conj(b) * c), np.imag(np.conj(c) * a), np.imag(np.conj(a) * b)], axis=1)

    def _nearest_face(self, queries: Places, candidates: int = 24) -> Integers:
        """Return the face nearest to each query among those around the nearest vertices."""
        k = min(candidates, self._tree.n)
        result = np.empty(len(queries), np.intp)
        for first in range(0, len(queries), AT_ONCE):
            some = queries[first : first + AT_ONCE]
            near = np.asarray(self._tree.query(plane(some), k=k)[1]).reshape(len(some), k)
            start = self._face_of_leaf[near]
            tried = np.concatenate([start, self.neighbours[start].reshape(len(some), -1)], axis=1)
            tried = np.where(tried < 0, start[:, :1], tried)
            face, repeated = tried.ravel(), np.repeat(some, tried.shape[1])
            weights = self._clamped(face, repeated)
            distance = np.abs((self.points[self.faces[face]] * weights).sum(axis=1) - repeated)
            nearest = distance.reshape(tried.shape).argmin(axis=1)
            result[first : first + len(some)] = tried[np.arange(len(some)), nearest]
        return result

    def _clamped(self, face: Integers, queries: Places) -> Floats:
        """Return the barycentric coordinates of the point of each face nearest to its query."""
        weights = self.barycentric(face, queries)
        outside = np.flatnonzero((weights < 0).any(axis=1))
        if len(outside):
            corners, x = self.points[self.faces[face[outside]]], queries[outside]
            best = np.full(len(outside), np.inf)
            nearest = weights[outside]
            for k in range(3):
                start, side = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
                square = np.abs(side) ** 2
                along = np.divide(np.real(np.conj(side) * (x - start)), square, out=np.zeros(len(x)), where=square > 0)
                along = np.clip(along, 0, 1)
                distance = np.abs(start + along * side - x)
                better = distance < best
                best[better] = distance[better]
                row = np.zeros((len(x), 3))
                row[:, k], row[:, (k + 1) % 3] = 1 - along, along
                nearest[better] = row[better]
            weights[outside] = nearest
        return weights


class TriangulatedSphere(TriangulatedDisc):
    """The same for a triangulation of the sphere by geodesics; points and queries are (n, 3), of the unit sphere.

    Barycentric coordinates are those of the point of the flat triangle under the query, seen from the centre.
    """

    @staticmethod
    def of(points: Places, faces: Integers) -> TriangulatedSphere:
        """Prepare the triangulation with these points, (n, 3), and faces, (m, 3), counter-clockwise from outside."""
        used, first = first_corners(faces, len(points))
        return TriangulatedSphere(points, faces, face_neighbours(faces, len(points)), KDTree(points[used]), first // 3)

    def _coordinates(self, points: Places) -> Floats:
        return points

    def _side_areas(self, face: Integers, queries: Places) -> Floats:
        a, b, c = (self.points[self.faces[face, k]] for k in range(3))
        # the volumes over the sides, from differences, which keep their digits next to a corner
        pairs = ((b, c), (c, a), (a, b))
        return np.stack([(queries * np.cross(x - queries, y - queries)).sum(axis=1) for x, y in pairs], axis=1)

    def _nearest_face(self, queries: Places, candidates: int = 24) -> Integers:
        """Return that face around the nearest vertices which a query lies least outside of."""
        k = min(candidates, self._tree.n)
        near = np.asarray(self._tree.query(queries, k=k)[1]).reshape(len(queries), k)
        start = self._face_of_leaf[near]
        best, least = start[:, 0].copy(), np.full(len(queries), -np.inf)
        for column in np.concatenate([start, self.neighbours[start].reshape(len(queries), -1)], axis=1).T:
            face = np.where(column < 0, start[:, 0], column)
            # behind the sphere's centre a face is as far away as can be
            before = (self.points[self.faces[face, 0]] * queries).sum(axis=1) > 0
            inside = np.where(before, self.barycentric(face, queries).min(axis=1), -np.inf)
            better = inside > least
            best[better], least[better] = face[better], inside[better]
        return best

    def _clamped(self, face: Integers, queries: Places) -> Floats:
        weights = np.maximum(self.barycentric(face, queries), 0)
        return weights / weights.sum(axis=1, keepdims=True)


def plane(points: Complexes) -> Floats:
    """Return complex numbers, (n,), as points of the plane, (n, 2)."""
    return np.stack([points.real, points.imag], axis=1)
