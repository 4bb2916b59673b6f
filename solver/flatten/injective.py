"""Repair of a planar map with triangles turned over: convex combinations of neighbours around them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from ..surface.cholesky import factorised
from ..surface.laplacian import cotangents
from ..surface.mesh import Booleans, Complexes, Floats, Integers, directed_edges
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
