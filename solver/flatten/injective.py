"""Repair of a planar map with triangles turned over: convex combinations of neighbours around them; and its proof."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from ..surface.cholesky import factorised
from ..surface.laplacian import cotangents
from ..surface.mesh import Booleans, Complexes, Floats, Integers, MeshError, TriangleMesh, directed_edges, plural
from .distortion import signed_areas


def untangled(faces: Integers, lengths: Floats, plane: Complexes, boundary: Integers) -> Complexes:
    """Return the map with no triangle turned over, changed around the turned ones alone.

    The vertices within some edges of a turned triangle become convex combinations of their neighbours, all others
    stay; where that does not help the surroundings grow, in the end to the whole disc, where Floater ("One-to-one
    piecewise linear mappings over triangulations", 2003) proves that it does.

    Parameters
    ----------
    faces, lengths : (m, 3) int, (m, 3) float64
        A triangulated disc and the length of the side opposite each corner.
    plane : (n,) complex128
        Its map to the plane.
    boundary : (k,) int
        Vertices on a strictly convex curve, which stay.
    """
    turned = signed_areas(plane, faces) <= 0
    if not turned.any():
        return plane
    n = len(plane)
    sides = directed_edges(faces)
    along = sides[:, 0], sides[:, 1]
    weight = np.maximum(cotangents(lengths).ravel(), 0)
    # an edge without weight could let its ends fall together
    weight = coo_array((weight + 0.01 * weight.mean(), along), shape=(n, n))
    even = coo_array((np.ones(len(sides)), along), shape=(n, n))
    weights, even = csr_array(weight + weight.T), csr_array(even + even.T)

    inside = np.zeros(n, bool)
    inside[faces] = True
    inside[boundary] = False
    near = np.zeros(n, bool)
    near[faces[turned]] = True
    attempts: list[tuple[csr_array, Booleans]] = []
    for rings in (1, 2, 4, 8, 16):
        for _ in range(rings):
            near = near | (even @ near > 0)
        attempts.append((weights, inside & near))
    for kind, free in (*attempts, (weights, inside), (even, inside)):
        trial = _combined(kind, plane, np.flatnonzero(free))
        if not (signed_areas(trial, faces) <= 0).any():
            return trial
    return plane


def require_injective(mesh: TriangleMesh, disc: Complexes) -> None:
    """Raise `MeshError` if a map to the disc, (n,), turns a triangle over, collapses one or leaves the disc.

    What rounding leaves open is decided in exact arithmetic.
    """
    places = disc[mesh.used]
    if np.isfinite(places).all() and (np.abs(places) <= 1 + 1e-12).all():
        count = int(collapsed(disc, mesh.faces).sum())
        if not count:
            return
        what = f"{plural(count, 'triangle')} would be turned over or lost"
    else:
        what = "parts of it would leave the disc"
    power = shrinkage(mesh, np.abs(signed_areas(np.nan_to_num(disc), mesh.faces)) / np.pi)
    raise MeshError(
        f"'{mesh.name}' is too deep or too long for a disc: {what}, as parts shrink to 1/10^{power} of their area "
        "there: cut them off, or cut it into pieces that are about as wide as long"
    )


def shrinkage(mesh: TriangleMesh, image: Floats) -> int:
    """Return the p for which some vertex' surroundings shrink to 1/10^p of their share of the area, at most.

    image : (m,) float64
        The triangles' shares of the area that the surface is mapped to.
    """
    around = np.bincount(mesh.faces.ravel(), np.repeat(image / 3, 3), len(mesh.vertices))
    seen = (around > 0) & (mesh.vertex_areas > 0)
    share = mesh.vertex_areas[seen] / mesh.area / around[seen]
    return int(np.log10(share.max())) if seen.any() else 0


def collapsed(disc: Complexes, faces: Integers) -> Booleans:
    """Return which triangles, (m,), are not counter-clockwise in the plane, in exact arithmetic."""
    a, b, c = (disc[faces[:, k]] for k in range(3))
    areas = signed_areas(disc, faces)
    result = areas <= 0
    # the error of the area is below that of its two products
    bound = 4e-16 * np.abs(b - a) * np.abs(c - a)
    for face in np.flatnonzero(np.abs(areas) <= bound).tolist():
        (ax, ay), (bx, by), (cx, cy) = (
            (Fraction(float(p.real)), Fraction(float(p.imag))) for p in (a[face], b[face], c[face])
        )
        result[face] = (bx - ax) * (cy - ay) <= (by - ay) * (cx - ax)
    return result


def _combined(weights: csr_array, plane: Complexes, free: Integers) -> Complexes:
    """Return the map with each free vertex at the weighted mean of its neighbours."""
    if not free.size:
        return plane
    rows = weights[free]
    held = plane.copy()
    held[free] = 0
    pulled = rows @ np.stack([held.real, held.imag], axis=1)
    solved = factorised(csc_array(diags_array(rows.sum(axis=1)) - rows[:, free]))(pulled)
    held[free] = solved[:, 0] + 1j * solved[:, 1]
    return held
