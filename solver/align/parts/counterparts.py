"""Which part of one mesh is which of another: an assignment over where a map of space puts them, size and shape."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ...surface.mesh import Floats, Integers
from ..result.agreement import STRETCH
from ..result.confidence import BOUND

NONE = 9.0
"""Cost from which on parts have no counterpart rather than each other: three standard deviations in all."""

UNLIKE = 1.0, 4.0
"""What another Euler characteristic costs, and a boundary that only one has: a standard deviation, and two. Decimation
changes neither; another artist may leave out what is not seen."""

NEAREST = 64
"""Parts that each part is compared with, at most: those that lie nearest. More matter to cards of hair alone."""


def costs(
    source: tuple[Floats, Floats, Integers], target: tuple[Floats, Floats, Integers], off: float
) -> tuple[Integers, Floats]:
    """Return pairs of parts that may be counterparts, (k, 2), and what each costs, (k,), less than `NONE`.

    The squared distance of their centres, in squares of `off`. It is the squares that make the assignment blind to what
    is common to many parts, as that all teeth lie a bit too far to the left. And how unlike their sizes and shapes are:
    the distance of Gaussian distributions with their covariances (Bures 1969; the rest of the Wasserstein distance,
    Dowson and Landau 1982), in their own size, where `STRETCH` is what right maps stretch lengths by.

    Parameters
    ----------
    source, target : (p, 3) float64, (p, 3, 3) float64, (p, 2) int
        Centres, covariances and shapes (`Parts.moments`, `Parts.shape`), all in the source's space.
    off : float
        Standard deviation of the centres' distance.
    """
    (centre, about, shape), (place, around, form) = source, target
    count = min(NEAREST, len(centre))
    reach = off * np.sqrt(NONE)
    distance, near = KDTree(centre).query(place, k=count, distance_upper_bound=reach)
    distance, near = distance.reshape(len(place), count), near.reshape(len(place), count)
    column, rank = np.nonzero(np.isfinite(distance))
    row = near[column, rank]
    first, second = about[row], around[column]
    trace, other = (np.trace(x, axis1=1, axis2=2) for x in (first, second))
    apart = trace + other - 2 * _overlap(first, second)
    size = np.sqrt(np.maximum(trace * other, np.finfo(float).tiny))
    cost = (distance[column, rank] / off) ** 2 + np.maximum(apart, 0) / size / STRETCH**2
    unlike = shape[row] != form[column]
    cost += np.where(unlike[:, 1], UNLIKE[1], UNLIKE[0] * unlike[:, 0])
    kept = cost < NONE
    return np.stack([row[kept], column[kept]], axis=1), cost[kept]


def assigned(pairs: Integers, cost: Floats) -> Integers:
    """Return the rows of `pairs`, (k, 2), that pair each part at most once, such that the cost in all is least.

    A part without a counterpart costs half of `NONE`. What cannot be paired with each other over any number of steps is
    assigned by itself, so that a thousand cards of hair cost no more than they have to.
    """
    if not len(pairs):
        return np.empty(0, np.intp)
    rows, columns = (np.unique(column, return_inverse=True)[1] for column in pairs.T)
    count = int(rows.max()) + 1
    links = coo_array((np.ones(len(pairs)), (rows, count + columns)), shape=(count + int(columns.max()) + 1,) * 2)
    group = connected_components(links, directed=False)[1][rows]
    order = np.argsort(group, kind="stable")
    chosen = []
    for some in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        (first, i), (second, j) = (np.unique(x[some], return_inverse=True) for x in (rows, columns))
        gain = np.zeros((len(first), len(second)))  # pairing what costs `NONE` is pairing neither
        gain[i, j] = cost[some] - NONE
        number = np.full(gain.shape, -1)
        number[i, j] = some
        taken = number[linear_sum_assignment(gain)]
        chosen.append(taken[taken >= 0])
    return np.sort(np.concatenate(chosen))


def certainty_of(pairs: Integers, cost: Floats, chosen: Integers, centre: Floats, diagonal: float) -> Floats:
    """Return how certain each chosen pair is, (k,): its share of what the alternatives of the target's part weigh.

    A pair weighs exp(-cost / 2), none exp(-NONE / 2). Alternatives nearer than `confidence.BOUND` are none, as the
    layers of a lash: what is taken for the other one is off by less.

    Parameters
    ----------
    pairs, cost : (k, 2) int, (k,) float64
    chosen : (l,) int
        Rows of these.
    centre : (p, 3) float64
        Of the source's parts.
    diagonal : float
        Of the source.
    """
    weight = np.exp(-cost / 2)
    mine = np.full(int(pairs[:, 1].max()) + 1, -1)
    mine[pairs[chosen, 1]] = pairs[chosen, 0]
    taken = mine[pairs[:, 1]]
    far = np.linalg.norm(centre[pairs[:, 0]] - centre[taken], axis=1) > BOUND * diagonal
    others = np.bincount(pairs[:, 1], np.where((taken >= 0) & far, weight, 0.0))[pairs[chosen, 1]]
    return weight[chosen] / (weight[chosen] + others + np.exp(-NONE / 2))


def _overlap(first: Floats, second: Floats) -> Floats:
    """Return the trace of (A^1/2 B A^1/2)^1/2 for covariances, (k, 3, 3) each."""
    size, axes = np.linalg.eigh(first)
    root = np.einsum("kij,kj,klj->kil", axes, np.sqrt(np.maximum(size, 0)), axes)
    return np.sqrt(np.maximum(np.linalg.eigvalsh(root @ second @ root), 0)).sum(axis=1)
