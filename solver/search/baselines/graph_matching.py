"""Graph matching by integer projected fixed point, on the hyperbolic lengths that Möbius transformations preserve.

Leordeanu, Hebert and Sukthankar, "An integer projected fixed point method for graph matching and MAP inference" (2009),
with the pairwise score of Leordeanu and Hebert (2005).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array, vstack

from ...stages import SearchProgress
from ...surface.mesh import Complexes, Floats, Integers
from ..fit import algebraic_fit, fitted
from ..measures import distances
from ..outcome import SearchResult
from .incumbent import Incumbent, incumbent

LARGEST_RADIUS = 0.5
"""Hyperbolic radius beyond which a match disc says nothing about lengths."""


def graph_matching(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
    z_max: float = 0.95,
    reflect: bool = False,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    iterations: int = 50,
) -> SearchResult:
    """Return the transformation fitted to the assignment of points that preserves their mutual lengths best.

    Parameters
    ----------
    source, target, radius, metric, weights, z_max, reflect, time_limit, threads, progress
        As in `search`; one thread is used. Lengths do not tell an orientation from its reflection, so `reflect` fits
        both to the one assignment.
    iterations : int
        At most this many rounds of projection and line search; fewer if a fixed point is reached.

    Returns
    -------
    SearchResult
        Not certified; `nodes` counts rounds.

    Notes
    -----
    The score of two pairs (i, a) and (j, b) is 4.5 - (d_ij - d_ab)^2 / (2 sigma^2), and 0 from 3 sigma on, with
    3 sigma = r_a + r_b, r being the hyperbolic radii of the match discs: if both pairs are matched by some
    transformation, then |d_ij - d_ab| <= r_a + r_b. Memory grows with the square of the number of compatible pairs.
    """
    best = incumbent(
        source, target, radius, metric=metric, weights=weights, z_max=z_max, reflect=reflect, time_limit=time_limit,
        threads=threads, progress=progress,
    )  # fmt: skip
    scores = _pairwise_scores(best)
    if scores is None:
        return best.result()
    chosen = _fixed_point(best, scores, iterations)
    support = (scores @ chosen)[chosen > 0] * best.problem.weight[chosen > 0]
    j, k = best.problem.point[chosen > 0], best.problem.target[chosen > 0]
    if (support > 0).sum() < 2:
        return best.result()
    scale = float(np.median(np.asarray(radius)))
    for reflected in best.sides:
        x, y = best.source(reflected)[j], best.target[k]
        start = algebraic_fit(x, y, support)
        # wrong pairs are among the assigned: a loss that lets go of them
        share = support / support.max()
        mobius = fitted(x, y, share, start, metric=metric, z_max=z_max, loss="cauchy", scale=scale)
        best.offer(mobius, reflected)
    return best.result()


def _pairwise_scores(best: Incumbent) -> csr_array | None:
    """Return the score of each two compatible pairs, (P, P), weighted by both; None if the time is over."""
    j, k, weight = best.problem.point, best.problem.target, best.problem.weight
    of_source, of_target = _lengths(best.problem.source), _lengths(best.target)
    radius = _lengths_of_radii(best)
    reach = radius[:, None] + radius
    rows: list[csr_array] = []
    at_once = max(1, (1 << 22) // len(j)) if len(j) else 1
    for first in range(0, len(j), at_once):
        if not best.goes_on():
            return None
        i, a = j[first : first + at_once, None], k[first : first + at_once, None]
        off = np.abs(of_source[i, j] - of_target[a, k])
        row, column = np.nonzero((off < reach[a, k]) & (i != j) & (a != k))
        three_sigmas = reach[a[row, 0], k[column]]
        score = 4.5 * (1 - (off[row, column] / three_sigmas) ** 2) * weight[first + row] * weight[column]
        rows.append(csr_array((score.astype(np.float32), (row, column)), shape=(len(off), len(j))))
    return csr_array(vstack(rows)) if rows else None


def _fixed_point(best: Incumbent, scores: csr_array, iterations: int) -> Floats:
    """Return the best assignment met, (P,) of zeros and ones: no source and no target point twice."""
    x = _leading_vector(best, scores)
    chosen, highest = np.zeros(len(x)), -np.inf
    for _ in range(iterations):
        if not best.goes_on():
            break
        best.nodes += 1
        gradient = scores @ x
        corner = _assignment(best, gradient)
        towards = scores @ corner
        if (value := float(corner @ towards)) > highest:
            chosen, highest = corner, value
        step = corner - x
        slope, bend = float(gradient @ step), float((towards - gradient) @ step)
        if slope <= 1e-9 * max(abs(highest), 1.0):
            break
        x = corner if bend >= 0 else x + min(-slope / bend, 1.0) * step
    return chosen


def _leading_vector(best: Incumbent, scores: csr_array, rounds: int = 30) -> Floats:
    """Return the scores' leading eigenvector, non-negative, by power iteration from a flat one (spectral matching)."""
    x = np.ones(len(best.problem.point))
    for _ in range(rounds):
        x = scores @ x
        if (length := np.linalg.norm(x)) == 0:
            return np.ones(len(x))
        x /= length
    return x


def _assignment(best: Incumbent, gain: Floats) -> Floats:
    """Return the one-to-one assignment among compatible pairs with the greatest total gain, (P,) of zeros and ones."""
    table = np.zeros(best.weights.shape)
    number = np.full(best.weights.shape, -1, dtype=np.intp)
    table[best.problem.point, best.problem.target] = gain
    number[best.problem.point, best.problem.target] = np.arange(len(gain))
    pairs: Integers = number[linear_sum_assignment(table, maximize=True)]
    result = np.zeros(len(gain))
    result[pairs[pairs >= 0]] = 1
    return result


def _lengths(points: Complexes) -> Floats:
    """Return the lengths between points, (n, n), in the Poincaré metric of curvature -1."""
    return 2.0 * np.arctanh(np.minimum(distances(points, points, "hyperbolic"), 1 - 1e-12))


def _lengths_of_radii(best: Incumbent) -> Floats:
    """Return how far, in the same metric, each target point's match disc reaches from it, (N2,)."""
    radius = np.zeros(len(best.target))
    # the farthest point of a disc lies on the ray through its centre
    outermost = np.abs(best.problem.centre) + best.problem.radius
    length = np.abs(best.target[best.problem.target])
    radius[best.problem.target] = np.abs(outermost - length) / np.maximum(np.abs(1 - length * outermost), 1e-12)
    return 2.0 * np.arctanh(np.minimum(radius, LARGEST_RADIUS))
