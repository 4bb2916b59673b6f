"""Values at points inside triangles: those at their corners, by barycentric coordinates."""

from __future__ import annotations

import numpy as np

from .mesh import Booleans, Floats, Integers


def interpolated(values: Floats, corners: Integers, weights: Floats) -> Floats:
    """Return values at points of a surface, (q, ...).

    Parameters
    ----------
    values : (n, ...) float64
        At the vertices.
    corners : (q, k) int
        The vertices around each point: of a triangle three, of an edge two.
    weights : (q, k) float64
        How much each counts: barycentric coordinates.
    """
    return weighted(values[corners], weights)


def weighted(values: Floats | Booleans, weights: Floats) -> Floats:
    """Return sums, (q, ...), of values at the corners around each point, (q, k, ...), by weights, (q, k)."""
    return np.einsum("qk,qk...->q...", weights, values)
