"""Nearest points on a surface, by position and by position and normal."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from .barycentric import interpolated, weighted
from .kept import kept
from .mesh import Booleans, Floats, Integers, TriangleMesh, first_corners

SUITABLE = 2
"""Samples around whose faces `SurfacePoints.most_alike` looks."""

LEAF = 20
"""Samples in each leaf of a tree: beside scipy's 10, queries take as long near the surface and a quarter less 0.06 of
the root of its area away (1,500 of them on a hand)."""

AT_ONCE = 4096
"""Queries that are answered together: enough for numpy, few enough to stay in the processor's cache."""

ASKED_AT_ONCE = 20_000
"""Queries that a tree answers together, on all processors: 0.05 s of them on two."""

BESIDE_RIM = 6
"""Faces, one behind the other, between a boundary and a sample from which on nothing nearest is on the boundary: the
six samples that suit a query best lie within three of each other."""

MANY, MOST_WORKERS = 6, 4
"""Such lots from which on several processors answer them, and how many at most: what numpy does between its loops, no
two threads do at the same time."""


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

    @kept
    def normals(self) -> Floats:
        """Unit normal of each vertex, (n, 3)."""
        return self.mesh.vertex_normals()

    @kept
    def _features(self) -> Floats:
        """Position and weighted normal of each vertex, (n, 6)."""
        return np.hstack([self.mesh.vertices, self.normal_weight * self.normals])

    @kept
    def _tree(self) -> tuple[KDTree, Integers]:
        """The vertices in use and the faces' centres, with positions and weighted unit normals; a face of each."""
        features = self._features
        used, first = first_corners(self.mesh.faces, len(features))
        centres = features[self.mesh.faces].mean(axis=1)
        length = np.linalg.norm(centres[:, 3:], axis=1, keepdims=True)
        centres[:, 3:] *= self.normal_weight / np.maximum(length, np.finfo(float).tiny)
        return KDTree(np.concatenate([features[used], centres]), LEAF), np.concatenate(
            [first // 3, np.arange(len(self.mesh.faces))]
        )

    @kept
    def _neighbours(self) -> Integers:
        return self.mesh.neighbours

    @kept
    def _on_rim(self) -> Booleans:
        rim = np.zeros(len(self.mesh.vertices), bool)
        for loop in self.loops:
            rim[loop] = True
        return rim

    @kept
    def _rim(self) -> tuple[KDTree, Floats, Floats]:
        """Points along the boundaries' edges, four to each, and the unit vectors along them."""
        start = self.mesh.vertices[np.concatenate(self.loops)]
        side = self.mesh.vertices[np.concatenate([np.roll(loop, -1) for loop in self.loops])] - start
        points = np.concatenate([start + share * side for share in (0.0, 0.25, 0.5, 0.75)])
        return KDTree(points), points, np.tile(_unit(side), (4, 1))

    def nearest_on_boundary(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the boundary's nearest point and its unit tangent there, (q, 3) each; to a quarter of an edge."""
        if not self.loops:  # nobody asks for any
            return points.copy(), np.zeros_like(points)
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
        Samples are the vertices and the faces' centres. `progress` is called with the share of the work done, in
        [0, 1], and may raise to end it.
        """
        tell = progress or (lambda _: None)
        near = self._near(points, normals, samples, lambda share: tell(share / 2))
        faces = np.concatenate([near, self._around(near[:, :2])], axis=1)
        return self._nearest_among(faces, points, self.mesh.vertices, lambda share: tell((1 + share) / 2))

    def may_be_beyond(
        self, points: Floats, normals: Floats, progress: Callable[[float], None] | None = None
    ) -> Booleans:
        """Return which queries, (q,), may have their nearest point on a boundary; the sample that suits best tells.

        It takes a third of the time of `nearest_point`, whose samples lie next to that one, within `BESIDE_RIM`.
        """
        return self._beside_rim[self._near(points, normals, 1, progress)[:, 0]]

    @kept
    def _beside_rim(self) -> Booleans:
        """Which faces, (m,), are within `BESIDE_RIM` of a boundary."""
        reached, faces = self._on_rim.copy(), self.mesh.faces
        for _ in range(BESIDE_RIM):
            reached[faces[reached[faces].any(axis=1)]] = True
        return reached[faces].any(axis=1)

    def most_alike(self, points: Floats, normals: Floats) -> tuple[Integers, Floats]:
        """Return the face, (q,), and barycentric coordinates, (q, 3), of the point that suits each query best.

        In position and normal together: the coordinates of a space of six dimensions, normals times `normal_weight`.
        There the surface consists of triangles too, with normals linear in each.
        """
        near = self._near(points, normals, SUITABLE)
        faces = np.concatenate([near, self._around(near[:, :1])], axis=1)
        query = np.hstack([points, self.normal_weight * normals])
        return self._nearest_among(faces, query, self._features)

    def at(self, face: Integers, barycentric: Floats) -> tuple[Floats, Floats, Booleans]:
        """Return points of the surface: position, (q, 3), unit normal, (q, 3), and whether on a boundary, (q,)."""
        corners = self.mesh.faces[face]
        beyond = (self._on_rim[corners] | (barycentric < 1e-9)).all(axis=1)
        position, normal = (interpolated(values, corners, barycentric) for values in (self.mesh.vertices, self.normals))
        return position, _unit(normal), beyond

    def _near(
        self, points: Floats, normals: Floats, samples: int, progress: Callable[[float], None] | None = None
    ) -> Integers:
        """Return the faces, (q, samples), of the samples that suit each query best; fewer if there are fewer."""
        tree, face_of_sample = self._tree
        count = min(samples, len(face_of_sample))
        query = np.hstack([points, self.normal_weight * normals])
        found = np.empty((len(points), count), np.intp)
        for start in range(0, len(points), ASKED_AT_ONCE):
            if progress:
                progress(start / len(points))
            rows = slice(start, start + ASKED_AT_ONCE)
            some = tree.query(query[rows], k=count, workers=-1 if len(points) > 1000 else 1)[1]
            found[rows] = np.asarray(some).reshape(-1, count)
        return face_of_sample[found]

    def _around(self, faces: Integers) -> Integers:
        """Return the faces next to faces, (q, k), as (q, 3 k); beyond a boundary the first again."""
        around = self._neighbours[faces].reshape(len(faces), 3 * faces.shape[1])
        return np.where(around < 0, faces[:, :1], around)

    def _nearest_among(
        self, faces: Integers, points: Floats, places: Floats, progress: Callable[[float], None] | None = None
    ) -> tuple[Integers, Floats]:
        """Return which of the faces, (q, k), is nearest to each point, (q, d), and where, with vertices at `places`."""
        count = faces.shape[1]
        face, barycentric = np.empty(len(points), faces.dtype), np.empty((len(points), 3))

        def answer(start: int) -> None:
            rows = slice(start, start + AT_ONCE)
            tried, query = faces[rows], np.repeat(points[rows], count, axis=0)
            corners = places[self.mesh.faces[tried.ravel()]]
            weights = nearest_in_triangle(query, corners)
            apart = weighted(corners, weights) - query
            best = _dot(apart, apart).reshape(-1, count).argmin(axis=1)
            each = np.arange(len(tried))
            face[rows], barycentric[rows] = tried[each, best], weights.reshape(-1, count, 3)[each, best]

        in_turn(answer, range(0, len(points), AT_ONCE), progress)
        return face, barycentric


def in_turn(work: Callable[[int], None], each: Sequence[int], progress: Callable[[float], None] | None) -> None:
    """Do the work for each number, where there are many on all processors; they must not depend on each other.

    `progress` is called in this thread, with the share of them that is done; once it raises no other is begun.
    """
    tell = progress or (lambda _: None)
    workers = min(os.cpu_count() or 1, MOST_WORKERS) if len(each) >= MANY else 1
    if workers == 1:
        for k, number in enumerate(each):
            tell(k / len(each))
            work(number)
        return
    with ThreadPoolExecutor(workers) as pool:
        begun = [pool.submit(work, number) for number in each]
        try:
            for k, one in enumerate(begun):
                tell(k / len(each))
                one.result()
        finally:
            for one in begun:
                one.cancel()


def nearest_in_triangle(points: Floats, corners: Floats) -> Floats:
    """Return barycentric coordinates, (q, 3), of the point of each triangle, (q, 3, d), nearest to a point, (q, d)."""
    b, c, p = (x - corners[:, 0] for x in (corners[:, 1], corners[:, 2], points))
    bb, bc, cc, pb, pc = _dot(b, b), _dot(b, c), _dot(c, c), _dot(p, b), _dot(p, c)
    square = bb * cc - bc**2
    square = np.where(square > 0, square, np.inf)
    v, w = (cc * pb - bc * pc) / square, (bb * pc - bc * pb) / square
    weights = np.stack([1 - v - w, v, w], axis=1)
    outside = np.flatnonzero((weights[:, 0] < 0) | (v < 0) | (w < 0) | ~np.isfinite(square))
    if not len(outside):
        return weights
    bb, cc, pb, pc, b, p = (x[outside] for x in (bb, cc, pb, pc, b, p))
    a = corners[outside, 2] - corners[outside, 1]
    aa, pa = _dot(a, a), _dot(p - b, a)
    tiny = np.finfo(float).tiny
    t, u, v = (np.clip(y / np.maximum(x, tiny), 0, 1) for x, y in ((bb, pb), (aa, pa), (cc, pc)))
    # squared distances from the nearest points of the three sides, less that from the first corner
    side = np.stack([t * (t * bb - 2 * pb), bb - 2 * pb + u * (u * aa - 2 * pa), v * (v * cc - 2 * pc)]).argmin(axis=0)
    zero = np.zeros(len(side))
    ends = np.array([[1 - t, t, zero], [zero, 1 - u, u], [1 - v, zero, v]])
    weights[outside] = ends[side, :, np.arange(len(side))]
    return weights


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the dot product of each row, (n,), of two (n, d)."""
    return np.einsum("ij,ij->i", a, b)


def _unit(vectors: Floats) -> Floats:
    """Return the vectors, (n, d), in unit length; zero ones stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(float).tiny)
