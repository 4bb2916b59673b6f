"""Nearest points on a surface, by position and by position and normal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from .locate import face_neighbours
from .mesh import Booleans, Floats, Integers, TriangleMesh


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """A surface prepared for queries with a position and a unit normal.

    Attributes
    ----------
    mesh : TriangleMesh
    loops : tuple of (k,) int
        The vertices of its boundaries in order.
    normal_weight : float
        Length that counts as much as a difference of 1 between unit normals.
    """

    mesh: TriangleMesh
    loops: tuple[Integers, ...]
    normal_weight: float

    @cached_property
    def _samples(self) -> tuple[Floats, Floats, Integers, Booleans]:
        """Position, unit normal, a face, and whether on a boundary: of each vertex in use and each face's centre."""
        faces, vertices = self.mesh.faces, self.mesh.vertices
        used, first = np.unique(faces.ravel(), return_index=True)
        normals = self.mesh.vertex_normals()
        across = normals[faces].sum(axis=1)
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
        rim = np.zeros(len(vertices), bool)
        rim[np.concatenate(self.loops)] = True
        return (
            np.concatenate([vertices[used], vertices[faces].mean(axis=1)]),
            np.concatenate([normals[used], across]),
            np.concatenate([first // 3, np.arange(len(faces))]),
            np.concatenate([rim[used], np.zeros(len(faces), bool)]),
        )

    @cached_property
    def _tree(self) -> KDTree:
        positions, normals, _, _ = self._samples
        return KDTree(np.hstack([positions, self.normal_weight * normals]))

    @cached_property
    def _rim(self) -> tuple[KDTree, Floats, Floats]:
        """Points along the boundaries' edges, four to each, and the unit vectors along them."""
        start = self.mesh.vertices[np.concatenate(self.loops)]
        side = self.mesh.vertices[np.concatenate([np.roll(loop, -1) for loop in self.loops])] - start
        points = np.concatenate([start + share * side for share in (0.0, 0.25, 0.5, 0.75)])
        along = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), np.finfo(float).tiny)
        return KDTree(points), points, np.tile(along, (4, 1))

    def nearest_sample(self, points: Floats, normals: Floats) -> tuple[Floats, Floats, Booleans]:
        """Return each query's best sample: position, (q, 3), normal, (q, 3), and whether on a boundary, (q,).

        Samples are the vertices and the faces' centres.
        """
        at, across, _, rim = self._samples
        found = self._tree.query(np.hstack([points, self.normal_weight * normals]), workers=-1)[1]
        return at[found], across[found], rim[found]

    def nearest_on_boundary(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the boundary's nearest point and its unit tangent there, (q, 3) each; to a quarter of an edge."""
        tree, at, along = self._rim
        found = tree.query(points)[1]
        tangent = along[found]
        ahead = ((points - at[found]) * tangent).sum(axis=1)
        return at[found] + ahead[:, None] * tangent, tangent

    def nearest_point(
        self, points: Floats, normals: Floats, samples: int = 6, progress: Callable[[float], None] | None = None
    ) -> tuple[Integers, Floats]:
        """Return the face, (q,), and barycentric coordinates, (q, 3), of the nearest point of the surface.

        Looked for in the faces of the samples that suit each query best in position and normal, and next to them.
        `progress` is called with the share of the work done, in [0, 1], and may raise to end it.
        """
        _, _, face_of_sample, _ = self._samples
        count = min(samples, len(face_of_sample))
        found = self._tree.query(np.hstack([points, self.normal_weight * normals]), k=count, workers=-1)[1]
        near = face_of_sample[np.asarray(found).reshape(len(points), count)]
        around = face_neighbours(self.mesh.faces, len(self.mesh.vertices))[near[:, :2]].reshape(len(points), -1)
        face, best = near[:, 0].copy(), np.full(len(points), np.inf)
        barycentric = np.zeros((len(points), 3))
        candidates = np.concatenate([near, np.where(around < 0, near[:, :1], around)], axis=1).T
        for k, column in enumerate(candidates):
            if progress:
                progress(k / len(candidates))
            corners = self.mesh.vertices[self.mesh.faces[column]]
            weights = nearest_in_triangle(points, corners)
            apart = np.einsum("qk,qkd->qd", weights, corners) - points
            distance = _dot(apart, apart)
            nearer = distance < best
            face[nearer], best[nearer], barycentric[nearer] = column[nearer], distance[nearer], weights[nearer]
        return face, barycentric


def nearest_in_triangle(points: Floats, corners: Floats) -> Floats:
    """Return barycentric coordinates, (q, 3), of the point of each triangle, (q, 3, 3), nearest to a point, (q, 3)."""
    b, c, p = (x - corners[:, 0] for x in (corners[:, 1], corners[:, 2], points))
    bb, bc, cc, pb, pc = _dot(b, b), _dot(b, c), _dot(c, c), _dot(p, b), _dot(p, c)
    square = bb * cc - bc**2
    square = np.where(square > 0, square, np.inf)
    v, w = (cc * pb - bc * pc) / square, (bb * pc - bc * pb) / square
    weights = np.stack([1 - v - w, v, w], axis=1)
    outside = np.flatnonzero((weights[:, 0] < 0) | (v < 0) | (w < 0) | ~np.isfinite(square))
    points, corners = points[outside], corners[outside]
    best = np.full(len(outside), np.inf)
    nearest = np.zeros((len(outside), 3))
    for k in range(3):  # the nearest point of each side
        start = corners[:, k]
        side = corners[:, (k + 1) % 3] - start
        length = np.maximum(_dot(side, side), np.finfo(float).tiny)
        along = np.clip(_dot(points - start, side) / length, 0, 1)
        apart = start + along[:, None] * side - points
        distance = _dot(apart, apart)
        nearer = distance < best
        best[nearer] = distance[nearer]
        nearest[nearer, k], nearest[nearer, (k + 1) % 3], nearest[nearer, k - 1] = 1 - along[nearer], along[nearer], 0
    weights[outside] = nearest
    return weights


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the dot product of each row, (n,), of two (n, 3)."""
    return np.einsum("ij,ij->i", a, b)
