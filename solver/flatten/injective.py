"""Repair of a planar map with triangles turned over: convex combinations of neighbours around them; and its proof."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components

from ..surface.cholesky import factorised
from ..surface.laplacian import cotangents
from ..surface.mesh import Booleans, Complexes, Floats, Integers, MeshError, TriangleMesh, directed_edges, plural
from .distortion import signed_areas

RINGS = (1, 2, 4, 8, 16)
"""Edges by which a place grows each time that it could not be put right."""

FEW = 200
"""Turned triangles of which single vertices are tried: each takes some milliseconds."""

SWEEPS = 8
"""Rounds over these vertices; on meshes with ten turned slivers two do."""


def untangled(faces: Integers, lengths: Floats, plane: Complexes, boundary: Integers) -> Complexes:
    """Return the map with no triangle turned over, changed around the turned ones alone.

    Where few are, as slivers are, their vertices are moved alone (`relocated`). The vertices within some edges of a
    triangle that is turned all the same become convex combinations of their neighbours, all others stay; where that
    does not help the surroundings of that place grow, in the end to the whole disc, where Floater ("One-to-one
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
    turned = collapsed(plane, faces)
    if not turned.any():
        return plane
    if turned.sum() <= FEW:
        plane = relocated(plane, faces, boundary)
        turned = collapsed(plane, faces)
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
    for rings in RINGS:
        for _ in range(rings):
            near = near | (even @ near > 0)
        trial = _combined(weights, plane, np.flatnonzero(inside & near))
        turned = collapsed(trial, faces)
        if not turned.any():
            return trial
        # places that are put right by now stay as they are, the others grow
        places = connected_components(_among(even, near), directed=False)[1]
        still = np.isin(places, places[faces[turned]]) & near
        plane = np.where(inside & near & ~still, trial, plane)
        near = still
    for kind in (weights, even):
        trial = _combined(kind, plane, np.flatnonzero(inside))
        if not collapsed(trial, faces).any():
            return trial
    return plane


def relocated(plane: Complexes, faces: Integers, held: Integers) -> Complexes:
    """Return the map with vertices of turned triangles, but those `held`, (k,), moved inside their stars, one by one.

    Each goes where the least distance from the lines of the sides around it is largest, a linear program, if that is
    more than it was: where the star has a kernel no triangle of it is turned then. Freitag and Plassmann, "Local
    optimization-based simplicial mesh untangling and improvement" (2000).
    """
    plane, stays = plane.copy(), np.zeros(len(plane), bool)
    stays[held] = True
    for _ in range(SWEEPS):
        corners = np.unique(faces[collapsed(plane, faces)])
        moved = False
        for vertex in corners[~stays[corners]].tolist():
            star = faces[(faces == vertex).any(axis=1)]
            corner = np.argmax(star == vertex, axis=1)
            row = np.arange(len(star))
            start, end = plane[star[row, (corner + 1) % 3]], plane[star[row, (corner + 2) % 3]]
            scale = np.abs(end - start).max()
            if not scale > 0:
                continue
            start, end = (start - plane[vertex]) / scale, (end - plane[vertex]) / scale
            inward = 1j * (end - start) / np.maximum(np.abs(end - start), 1e-12)
            # the distance of x from a side is that of 0 plus inward . x
            distance = -(np.conj(inward) * start).real
            rows = np.column_stack([-inward.real, -inward.imag, np.ones(len(star))])
            best = linprog([0, 0, -1], rows, distance, bounds=(None, None))
            if best.status == 0 and best.x[2] > distance.min() + 1e-9:
                plane[vertex] += scale * complex(best.x[0], best.x[1])
                moved = True
        if not moved:
            break
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


def _among(links: csr_array, chosen: Booleans) -> csr_array:
    """Return the links, (n, n), between chosen vertices."""
    only = diags_array(chosen.astype(float))
    return csr_array(only @ links @ only)


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
