"""Small parts that ride along: they move as one piece, as what they lie beside moves and turns on the whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..surface.mesh import Floats, Integers, TriangleMesh
from .correspond import Correspondence
from .frames import nearest_orthogonal
from .parts import pieces

FEWEST = 3
"""Vertices that tell how a surface turns: one of its triangles."""


@dataclass(frozen=True, eq=False)
class Riders:
    """What rides as one piece: a part all of whose vertices have one point of the source, as `completed` gives it.

    What it lies beside is the surface around this point, of its own extent: on an eyeball the eyeball, on a jaw the
    teeth, on a sleeve the cloth below a button. How a displacement moves that on the whole is a rotation and a shift
    (Kabsch 1976), about the place where the part is on the source.

    Attributes
    ----------
    vertices : (q,) int
        Of the target.
    group : (q,) int
        Which rider each is of.
    places : (q, 3) float64
        Where they are on the source.
    rotation, scale : (q, 3, 3) and (q,) float64
        How lengths and directions come from there.
    around : tuple of ((k,) int, (k,) float64)
        What each rider lies beside: vertices of the source and their weights, which sum to 1.
    source : (n_source, 3) float64
        The source's vertices.
    """

    vertices: Integers
    group: Integers
    places: Floats
    rotation: Floats
    scale: Floats
    around: tuple[tuple[Integers, Floats], ...]
    source: Floats

    @staticmethod
    def of(
        correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh, rotation: Floats, scale: Floats
    ) -> Riders | None:
        """Return what rides, None if nothing does.

        Parameters
        ----------
        correspondence : Correspondence
        source, target : TriangleMesh
        rotation, scale : (n, 3, 3) and (n,) float64
            How the surface far around each vertex of the target comes from the source.
        """
        leader, part = correspondence.leader, correspondence.part
        if leader is None or part is None or not (leader >= 0).any():
            return None
        groups = [
            rows for k in np.unique(part[leader >= 0]) if _is_one(correspondence, rows := _riding(part, leader, k))
        ]
        if not groups:
            return None
        rows = np.concatenate(groups)
        group = np.repeat(np.arange(len(groups)), [len(own) for own in groups])
        ahead = leader[rows]
        there = correspondence.matrix()[ahead] @ source.vertices
        turned = np.einsum("qji,qj->qi", rotation[ahead], target.vertices[rows] - target.vertices[ahead])
        around = _around(correspondence, source, target, groups, scale)
        return Riders(
            rows, group, there + turned / scale[ahead, None], rotation[ahead], scale[ahead], around, source.vertices
        )

    def __call__(self, displacements: Floats) -> Floats:
        """Return the displacements of the riding vertices, (q, 3), for some of the source's vertices, (n_source, 3)."""
        middle, shift = np.empty((2, len(self.around), 3))
        turn = np.empty((len(self.around), 3, 3))
        for k, (at, weight) in enumerate(self.around):
            places, moved = self.source[at], displacements[at]
            middle[k], shift[k] = weight @ places, weight @ moved
            before = places - middle[k]
            turn[k] = (weight[:, None] * (before + moved - shift[k])).T @ before
        still = np.array([not displacements[at].any() for at, _ in self.around])
        turn = nearest_orthogonal(turn)
        turn[still] = np.eye(3)
        lever = self.places - middle[self.group]
        moved = shift[self.group] + np.einsum("qij,qj->qi", turn[self.group] - np.eye(3), lever)
        return self.scale[:, None] * np.einsum("qij,qj->qi", self.rotation, moved)


def _riding(part: Integers, leader: Integers, number: int) -> Integers:
    return np.flatnonzero((part == number) & (leader >= 0))


def _is_one(correspondence: Correspondence, rows: Integers) -> bool:
    """Return whether vertices have one point of the source, and are enough to turn."""
    face, weights = correspondence.face[rows], correspondence.barycentric[rows]
    return len(rows) >= FEWEST and face[0] >= 0 and bool((face == face[0]).all() and (weights == weights[0]).all())


def _around(
    correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh, groups: list[Integers], scale: Floats
) -> tuple[tuple[Integers, Floats], ...]:
    """Return the vertices around each rider, of the piece that it is on, as far as it is wide, with weights."""
    piece, tree = pieces(source.faces, len(source.vertices)), KDTree(source.vertices)
    areas = np.maximum(source.vertex_areas, 1e-12 * source.area)
    found = []
    assert correspondence.leader is not None
    for rows in groups:
        corner = correspondence.source_triangles[correspondence.face[rows[0]]]
        point = correspondence.barycentric[rows[0]] @ source.vertices[corner]
        own = target.vertices[rows]
        reach = float(np.linalg.norm(np.ptp(own, axis=0))) / float(scale[correspondence.leader[rows[0]]])
        near = np.array(tree.query_ball_point(point, reach), np.intp)
        near = np.union1d(near[piece[near] == piece[corner[0]]], corner)
        apart = np.linalg.norm(source.vertices[near] - point, axis=1) / max(reach, 1e-300)
        weight = areas[near] * np.maximum(1 - apart**2, 0.01) ** 2
        found.append((near, weight / weight.sum()))
    return tuple(found)
