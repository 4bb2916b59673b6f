"""Many shapes of corresponding points, superimposed onto their mean."""

from __future__ import annotations

import numpy as np

from ..surface.mesh import Floats
from ..surface.superimposing import Pose, superimposing

SETTLED = 1e-10
"""Change of the mean, squared, in squared centroid sizes, at which it has settled: beyond what any scanner resolves."""

ROUNDS = 100
"""Rounds at most, so that it ends where two means alternate."""


def centroid_size(points: Floats, weights: Floats) -> float:
    """Return the root of the weighted mean of squared distances from the centroid."""
    share = weights / weights.sum()
    return float(np.sqrt(share @ ((points - share @ points) ** 2).sum(axis=1)))


def generalised(shapes: Floats, weights: Floats, mirrored: list[bool]) -> tuple[Floats, list[Pose]]:
    """Return the mean of shapes, (n, 3), of the mean centroid size, and the pose that brings each onto it.

    Gower, "Generalized Procrustes analysis" (1975): each is scaled to the same centroid size and turned onto the mean,
    again and again. The mean lies as the first shape does.

    Parameters
    ----------
    shapes : (k, n, 3) float64
        Point i of each corresponds to point i of the others.
    weights : (n,) float64
    mirrored : list of bool
        Which shapes are mirror images of the first.
    """
    share = weights / weights.sum()
    sizes = [centroid_size(shape, share) for shape in shapes]
    normal = np.stack([(shape - share @ shape) / size for shape, size in zip(shapes, sizes, strict=True)])
    mean = normal[0]
    for _ in range(ROUNDS):
        turned = [
            superimposing(shape, mean, share, mirrored=other)(shape)
            for shape, other in zip(normal, mirrored, strict=True)
        ]
        new = np.mean(turned, axis=0)
        new /= centroid_size(new, share)
        moved = float(share @ ((new - mean) ** 2).sum(axis=1))
        mean = new
        if moved < SETTLED:
            break
    # turned back onto the first, which the rounds may have left by a little
    mean = float(np.mean(sizes)) * superimposing(mean, normal[0], share)(mean) + share @ shapes[0]
    poses = [
        superimposing(shape, mean, share, mirrored=other, scaled=True)
        for shape, other in zip(shapes, mirrored, strict=True)
    ]
    return mean, poses
