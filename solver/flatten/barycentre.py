"""The transformations that put the mean of points at the centre of the disc or sphere: free of the points' pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..mobius import Mobius, SphereMobius
from ..surface.mesh import Complexes, Floats


def conformal_barycentre(points: Complexes, weights: Floats, tolerance: float = 1e-12) -> complex:
    """Return the z for which the weighted mean of `Mobius(z, 0)(points)` is 0.

    Any `Mobius` carries the barycentre of points to that of their images, so it centres a disc in the one way that is
    free of pose (Douady and Earle 1986). It exists unless half of the weight sits in one point of the unit circle.

    Parameters
    ----------
    points : (n,) complex128
        |points| <= 1.
    weights : (n,) float64
        Non-negative, with a positive sum.
    tolerance : float
        The mean is taken as 0 below this.
    """
    weights = weights / weights.sum()

    def mean_of(moved: Complexes) -> complex:
        return complex(np.sum(weights * moved))

    def step_of(moved: Complexes, mean: complex) -> complex:
        # Newton's step for the mean of (x - z)/(1 - x conj(z)) at z = 0: 0 = mean - z + conj(z) square
        square = complex(np.sum(weights * moved**2))
        return (mean + square * mean.conjugate()) / max(1 - abs(square) ** 2, 1e-12)

    return _centring(Mobius(), points, mean_of, step_of, lambda step: Mobius(step, 0.0), abs, tolerance).z


def spherical_barycentre(points: Floats, weights: Floats, tolerance: float = 1e-12) -> SphereMobius:
    """Return a transformation for which the weighted mean of the points' images is 0: see `conformal_barycentre`.

    Its h is the only one; with its rotation what is left of the points' pose is what they had before.

    Parameters
    ----------
    points : (n, 3) float64
        On the unit sphere.
    weights : (n,) float64
        Non-negative, with a positive sum, less than half of it in one point.
    tolerance : float
        The mean is taken as 0 below this.
    """
    weights = weights / weights.sum()

    def mean_of(moved: Floats) -> Floats:
        return weights @ moved

    def step_of(moved: Floats, mean: Floats) -> Floats:
        # T_h(x) is x - 2 (h - x (x.h)) to first order
        square = np.eye(3) - (weights[:, None] * moved).T @ moved
        return 0.5 * np.linalg.solve(square + 1e-12 * np.eye(3), mean)

    def moved_by(step: Floats) -> SphereMobius:
        x, y, z = step.tolist()
        return SphereMobius((x, y, z))

    def length(x: Floats) -> float:
        return float(np.sqrt((x**2).sum()))

    return _centring(SphereMobius(), points, mean_of, step_of, moved_by, length, tolerance)


def _centring(
    centring: Any,
    points: Any,
    mean_of: Callable[[Any], Any],
    step_of: Callable[[Any, Any], Any],
    moved_by: Callable[[Any], Any],
    length: Callable[[Any], float],
    tolerance: float,
) -> Any:
    """Return the transformation after which the mean of points is 0, by Newton's method, in the disc or on the sphere.

    `centring` is the identity; `mean_of` images; `step_of` images and their mean, Newton's step; `moved_by` a step, the
    transformation that it is; `length` of a mean or step.
    """
    moved, mean = points, mean_of(points)
    for _ in range(200):
        if length(mean) < tolerance:
            break
        step = step_of(moved, mean)
        step = step * min(1.0, 0.7 / length(step))
        while True:  # shorten until the mean falls, so that points near the circle cannot throw it about
            trial = moved_by(step) @ centring
            moved_trial = trial(points)
            mean_trial = mean_of(moved_trial)
            if length(mean_trial) < length(mean) or length(step) < 1e-15:
                break
            step = step * 0.5
        if length(step) < 1e-15:
            break
        centring, moved, mean = trial, moved_trial, mean_trial
    return centring
