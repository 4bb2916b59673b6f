"""Means and medians over a surface, weighted by area."""

from __future__ import annotations

import numpy as np

from .mesh import Floats


def standardised(values: Floats, weights: Floats) -> Floats:
    """Return each column of `values`, (n, d), with weighted mean 0 and weighted standard deviation 1."""
    weights = weights / weights.sum()
    centred = values - weights @ values
    deviation = np.sqrt(weights @ centred**2)
    return centred / np.where(deviation > 0, deviation, 1)


def weighted_median(values: Floats, weights: Floats) -> float:
    """Return the value, of (n,), below and above which lies half of the weight, (n,), each.

    >>> weighted_median(np.array([3.0, 1.0, 2.0]), np.array([5.0, 1.0, 1.0]))
    3.0
    """
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2)]])
