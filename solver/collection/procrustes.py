"""Corresponding points superimposed: one pair of shapes, and many onto their mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..surface.mesh import Floats

SETTLED = 1e-10
"""Change of the mean, squared, in squared centroid sizes, at which it has settled: beyond what any scanner resolves."""

ROUNDS = 100
"""Rounds at most; on 14 teeth it settles in 5 to 8."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A similarity: x -> scale * x @ turn + shift.

    Attributes
    ----------
    turn : (3, 3) float64
        Orthogonal; of determinant -1 where it mirrors.
    shift : (3,) float64
    scale : float
    """

    turn: Floats
    shift: Floats
    scale: float = 1.0

    def __call__(self, points: Floats) -> Floats:
        """Return the images of points, (q, 3)."""
        return self.scale * points @ self.turn + self.shift


def superimposing(
    points: Floats, onto: Floats, weights: Floats, *, mirrored: bool = False, scaled: bool = False
) -> Pose:
    """Return the pose that brings points nearest to others, in the sum of weighted squares.

    Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976); the scale by Umeyama (1991).

    Parameters
    ----------
    points, onto : (q, 3) float64
    weights : (q,) float64
        Non-negative, with a positive sum.
    mirrored : bool
        Whether the pose is to turn orientation round.
    scaled : bool
        Whether it may change size.
    """
    share = weights / weights.sum()
    middle, other = share @ points, share @ onto
    left, stretch, right = np.linalg.svd((share[:, None] * (points - middle)).T @ (onto - other))
    sign = np.ones(3)
    if (np.linalg.det(left @ right) < 0) != mirrored:
        sign[2] = -1
    turn = (left * sign) @ right
    square = float(share @ ((points - middle) ** 2).sum(axis=1))
    scale = float(stretch @ sign) / square if scaled and square > 0 else 1.0
    return Pose(turn, other - scale * middle @ turn, scale)


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
