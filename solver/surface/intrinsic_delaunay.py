"""Intrinsic Delaunay triangulation of a surface: edges flipped, on side lengths alone, until no weight is negative.

Bobenko and Springborn, "A Discrete Laplace-Beltrami Operator for Simplicial Surfaces" (2007); Fisher, Springborn,
Schröder and Bobenko, "An Algorithm for the Construction of Intrinsic Delaunay Triangulations" (2007). The vertices and
the surface stay what they are; two vertices may come to share several edges, and an edge may join a vertex to itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from .laplacian import cotangents
from .mesh import Booleans, Floats, Integers


@dataclass(frozen=True, eq=False)
class IntrinsicTriangulation:
    """A triangulation given by side lengths instead of positions.

    Attributes
    ----------
    faces : (m, 3) int
        Vertex indices, counter-clockwise.
    lengths : (m, 3) float64
        Length of the side opposite each corner.
    twins : (3 m,) int
        Side 3 f + k is opposite corner k of face f; its twin is the same edge in the other face, -1 on the boundary.
    vertex_count : int
        Vertices are 0 to vertex_count - 1, whether a face uses them or not.
    """

    faces: Integers
    lengths: Floats
    twins: Integers
    vertex_count: int

    @property
    def vertex_areas(self) -> Floats:
        """A third of the faces around each vertex, (n,), in squared length units."""
        _, height = _apex(*self.lengths.T)
        third = np.repeat(self.lengths[:, 0] * height / 6, 3)
        return np.bincount(self.faces.ravel(), third, self.vertex_count).astype(np.float64, copy=False)

    @property
    def inner_sides(self) -> Integers:
        """One side of each edge that has two faces, (e,)."""
        return np.flatnonzero(np.arange(len(self.twins)) < self.twins)


def intrinsic_delaunay(start: IntrinsicTriangulation, tolerance: float = 1e-10) -> IntrinsicTriangulation:
    """Return the intrinsic Delaunay triangulation of a surface: at each inner edge the opposite cotangents sum to >= 0.

    Parameters
    ----------
    start : IntrinsicTriangulation
        Any triangulation of the surface; each triangle inequality holds strictly.
    tolerance : float
        A sum above minus this share of its two terms and one counts as non-negative, so that rounding cannot flip
        cocircular vertices for ever.
    """
    faces, lengths, twins = start.faces.copy(), start.lengths.copy(), start.twins.copy()
    cotangent = cotangents(lengths)
    sides = start.inner_sides
    # flips needed grow with the number of edges in practice: far more are rounding going in circles
    for _ in range(100 + len(sides)):
        one, other = cotangent.ravel()[sides], cotangent.ravel()[twins[sides]]
        bad = sides[one + other < -tolerance * (np.abs(one) + np.abs(other) + 1)]
        bad = bad[bad // 3 != twins[bad] // 3]
        if not bad.size:
            break
        bad = bad[_independent(bad // 3, twins[bad] // 3, len(faces))]
        touched = _flip(faces, lengths, twins, bad)
        cotangent[touched] = cotangents(lengths[touched])
        around = (3 * touched[:, None] + np.arange(3)).ravel()
        around = around[twins[around] >= 0]
        sides = np.unique(np.minimum(around, twins[around]))
    return IntrinsicTriangulation(faces, lengths, twins, start.vertex_count)


def edge_weights(surface: IntrinsicTriangulation) -> tuple[Integers, Integers, Floats]:
    """Return the ends of all edges, (e,) each, and their cotangent weights, (e,), none of which is negative.

    On an intrinsic Delaunay triangulation no inner edge's is; that of an edge on the boundary, which has one angle
    opposite, is taken as 0 where that is obtuse.
    """
    sides = np.flatnonzero(surface.twins < np.arange(len(surface.twins)))
    half = 0.5 * cotangents(surface.lengths).ravel()
    weight = np.maximum(half[sides] + np.where(surface.twins[sides] >= 0, half[surface.twins[sides]], 0), 0)
    face, k = np.divmod(sides, 3)
    return surface.faces[face, (k + 1) % 3], surface.faces[face, (k + 2) % 3], weight


def non_negative_laplacian(surface: IntrinsicTriangulation) -> csr_array:
    """Return the Laplacian, (n, n), of the weights that `edge_weights` returns.

    Diffusion by it is a mean: what comes out lies between the least and the largest of what went in.
    """
    i, j, weight = edge_weights(surface)
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([j, i, i, j])
    values = np.concatenate([-weight, -weight, weight, weight])
    size = surface.vertex_count
    return csr_array(coo_array((values, (rows, columns)), shape=(size, size)))


def without_chords(
    triangulation: IntrinsicTriangulation, boundary: Integers, rounds: int = 20
) -> IntrinsicTriangulation:
    """Return the intrinsic Delaunay triangulation with the inner edges between boundary vertices cut in the middle.

    What lies behind such an edge is cut off from the rest of the interior and would receive no harmonic measure. The
    new vertices come after the old ones. After `rounds` a chord may stay.
    """
    on_boundary = np.zeros(triangulation.vertex_count, bool)
    on_boundary[boundary] = True
    for _ in range(rounds):
        triangulation = intrinsic_delaunay(triangulation)
        on_boundary = np.pad(on_boundary, (0, triangulation.vertex_count - len(on_boundary)))  # the new ones are inside
        faces, sides = triangulation.faces, triangulation.inner_sides
        face, k = np.divmod(sides, 3)
        chords = sides[on_boundary[faces[face, (k + 1) % 3]] & on_boundary[faces[face, (k + 2) % 3]]]
        if not chords.size:
            break
        first, second = chords // 3, triangulation.twins[chords] // 3
        triangulation = _cut(triangulation, chords[_independent(first, second, len(faces))])
    return triangulation


def with_interior(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """Return a disc of a single triangle with a vertex in its middle, any other disc as it is."""
    if len(triangulation.faces) > 1:
        return triangulation
    n, (a, b, c), sides = triangulation.vertex_count, triangulation.faces[0], triangulation.lengths[0]
    to_a, to_b, to_c = np.sqrt(2 * (sides**2).sum() - 3 * sides**2) / 3
    faces = np.array([[a, b, n], [b, c, n], [c, a, n]])
    lengths = np.array([[to_b, to_a, sides[2]], [to_c, to_b, sides[0]], [to_a, to_c, sides[1]]])
    return IntrinsicTriangulation(faces, lengths, np.array([4, 6, -1, 7, 0, -1, 1, 3, -1]), n + 1)


def _independent(first: Integers, second: Integers, face_count: int) -> Booleans:
    """Choose edges of which no two share a face; at least the last one is chosen."""
    claim = np.empty(face_count, np.intp)
    ids = np.arange(len(first))
    # of several writes to one face the last one stays
    claim[np.stack([first, second], axis=1).ravel()] = np.repeat(ids, 2)
    return (claim[first] == ids) & (claim[second] == ids)


def _flip(faces: Integers, lengths: Floats, twins: Integers, sides: Integers) -> Integers:
    """Flip edges that share no face, in place; return the faces they lie in.

    Side s of face (c, a, b) and its twin t of face (d, b, a) become the faces (c, a, d) and (d, b, c).
    """
    f, k = np.divmod(sides, 3)
    g, l = np.divmod(twins[sides], 3)  # noqa: E741
    next_k, last_k, next_l, last_l = (k + 1) % 3, (k + 2) % 3, (l + 1) % 3, (l + 2) % 3
    c, a, b, d = faces[f, k], faces[f, next_k], faces[f, last_k], faces[g, l]
    ab, bc, ca = lengths[f, k], lengths[f, next_k], lengths[f, last_k]
    ad, db = lengths[g, next_l], lengths[g, last_l]
    cd = _diagonal(ab, bc, ca, ad, db)

    faces[f] = np.stack([c, a, d], axis=1)
    faces[g] = np.stack([d, b, c], axis=1)
    lengths[f] = np.stack([ad, cd, ca], axis=1)
    lengths[g] = np.stack([bc, cd, db], axis=1)
    _move_sides(
        twins,
        np.stack([3 * g + next_l, 3 * f + last_k, 3 * f + next_k, 3 * g + last_l]),  # a-d, c-a, b-c, d-b
        np.stack([3 * f, 3 * f + 2, 3 * g, 3 * g + 2]),
    )
    _join(twins, 3 * f + 1, 3 * g + 1)
    return np.concatenate([f, g])


def _cut(old: IntrinsicTriangulation, sides: Integers) -> IntrinsicTriangulation:
    """Put a vertex in the middle of edges that share no face.

    Side s of face (c, a, b) and its twin t of face (d, b, a) become (c, a, m), (c, m, b), (d, b, m), (d, m, a).
    """
    m, count = len(old.faces), len(sides)
    f, k = np.divmod(sides, 3)
    g, l = np.divmod(old.twins[sides], 3)  # noqa: E741
    next_k, last_k, next_l, last_l = (k + 1) % 3, (k + 2) % 3, (l + 1) % 3, (l + 2) % 3
    f2, g2 = m + np.arange(count), m + count + np.arange(count)
    c, a, b, d = old.faces[f, k], old.faces[f, next_k], old.faces[f, last_k], old.faces[g, l]
    ab, bc, ca = old.lengths[f, k], old.lengths[f, next_k], old.lengths[f, last_k]
    ad, db = old.lengths[g, next_l], old.lengths[g, last_l]
    middle = old.vertex_count + np.arange(count)
    to_c, to_d = _median(ab, bc, ca), _median(ab, ad, db)

    faces = np.concatenate([old.faces, np.empty((2 * count, 3), np.intp)])
    lengths = np.concatenate([old.lengths, np.empty((2 * count, 3))])
    twins = np.concatenate([old.twins, np.full(6 * count, -1, np.intp)])
    for face, corners, opposite in (
        (f, (c, a, middle), (ab / 2, to_c, ca)),
        (f2, (c, middle, b), (ab / 2, bc, to_c)),
        (g, (d, b, middle), (ab / 2, to_d, db)),
        (g2, (d, middle, a), (ab / 2, ad, to_d)),
    ):
        faces[face] = np.stack(corners, axis=1)
        lengths[face] = np.stack(opposite, axis=1)
    _move_sides(
        twins,
        np.stack([3 * f + last_k, 3 * f + next_k, 3 * g + last_l, 3 * g + next_l]),  # c-a, b-c, d-b, a-d
        np.stack([3 * f + 2, 3 * f2 + 1, 3 * g + 2, 3 * g2 + 1]),
    )
    for one, other in ((3 * f, 3 * g2), (3 * f2, 3 * g), (3 * f + 1, 3 * f2 + 2), (3 * g + 1, 3 * g2 + 2)):
        _join(twins, one, other)
    return IntrinsicTriangulation(faces, lengths, twins, old.vertex_count + count)


def _move_sides(twins: Integers, moved: Integers, place: Integers) -> None:
    """Let the sides `moved` be the sides `place`, in place."""
    across = twins[moved]
    # two changed quadrilaterals may be neighbours: a twin that moves too is looked up in its new place
    new_place = np.arange(len(twins))
    new_place[moved.ravel()] = place.ravel()
    across = np.where(across >= 0, new_place[across], -1)
    twins[place] = across
    inner = across >= 0
    twins[across[inner]] = place[inner]


def _join(twins: Integers, one: Integers, other: Integers) -> None:
    twins[one], twins[other] = other, one


def _median(base: Floats, left: Floats, right: Floats) -> Floats:
    """Return the distance of the third corner from the middle of the base."""
    return 0.5 * np.sqrt(2 * (left**2 + right**2) - base**2)


def _diagonal(ab: Floats, bc: Floats, ca: Floats, ad: Floats, db: Floats) -> Floats:
    """Return the length of the other diagonal, c-d, of quadrilaterals a, d, b, c unfolded into the plane."""
    above, below = _apex(ab, ca, bc), _apex(ab, ad, db)
    return np.hypot(above[0] - below[0], above[1] + below[1])


def _apex(base: Floats, left: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Return where the third corner lies over the base, from its left end, and how high above it."""
    along = (base + (left - right) * (left + right) / base) / 2
    high, middle, low = np.sort(np.stack([base, left, right]), axis=0)[::-1]
    square = (high + (middle + low)) * (low - (high - middle)) * (low + (high - middle)) * (high + (middle - low))
    return along, np.sqrt(np.maximum(square, 0)) / (2 * base)
