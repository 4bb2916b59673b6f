"""The objective that `align` gives the search: which points stand for the surfaces, and which pairs may match."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...flatten.sphere import Flat, SphereFlattening
from ...mobius import hyperbolic_distance
from ...surface.mesh import Booleans, Floats, Integers, Places
from ...surface.sampling import HORIZON, extrema, farthest_points


def compatibility(source: Floats, target: Floats, share: float) -> Floats:
    """Return the weight, (N1, N2), of each pair of descriptors, from how rare it is to be so alike.

    1 - p / share, at least 0, where p is the share of the target that is more like the source point. So weights need no
    unit of likeness: whatever the noise, each source point may match as much of the target.
    """
    square = (source**2).sum(axis=1)[:, None] + (target**2).sum(axis=1) - 2 * source @ target.T
    rank = np.empty(square.shape)
    np.put_along_axis(rank, np.argsort(square, axis=1, kind="stable"), 0.5 + np.arange(square.shape[1])[None], axis=1)
    return np.maximum(1 - rank / (share * square.shape[1]), 0)


def usual_difference(source: Floats, target: Floats) -> float:
    """Return the median distance of matched descriptors, (m, d) each: how alike these two surfaces are.

    At least a tenth of what their standard deviation makes of it; the standard deviation itself where nothing matched.
    """
    most = float(np.sqrt(source.shape[1]))
    if not len(source):
        return most
    return max(float(np.median(np.linalg.norm(source - target, axis=1))), 0.1 * most)


def covering_radius(points: Places) -> Floats:
    """Return each point's distance to its second nearest neighbour, (n,), at most 0.5.

    Discs of these radii around evenly spread points cover the region between them. In the disc, (n,), it is the
    pseudo-hyperbolic distance; on the sphere, (n, 3), the chord.
    """
    if points.ndim == 2:
        distance = np.linalg.norm(points[:, None] - points, axis=2)
    else:
        distance = hyperbolic_distance(points[:, None], points)
    nth = min(2, len(points) - 1)
    return np.clip(np.partition(distance, nth, axis=1)[:, nth], 1e-6, 0.5)


def interior(flattening: Flat) -> Booleans:
    """Return which vertices, (n,), are in use and far enough inside the disc for the search."""
    if isinstance(flattening, SphereFlattening):
        return flattening.mesh.used.copy()
    inside = np.isfinite(flattening.disc.real) & (np.abs(flattening.disc) < HORIZON)
    inside[flattening.boundary] = False
    return inside


def source_points(
    flattening: Flat, descriptors: Floats, count: int, progress: Callable[[float], None] | None = None
) -> Integers:
    """Return the source points: up to half of them extrema of curvature, the others far from these and each other.

    `progress` is called with the share of the points chosen, in [0, 1], and may raise to end it.
    """
    inside = interior(flattening)
    peaks = extrema(flattening.mesh, descriptors[:, 1], inside)[: count // 2]
    return farthest_points(flattening.mesh, count, peaks, inside, progress)
