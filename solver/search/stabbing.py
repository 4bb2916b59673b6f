"""Stabbing arcs: the rotation that lies in arcs of the greatest total weight.

An arc says for which rotations theta one source point lands in one match disc. Each source point counts once, with the
largest weight among its arcs that hold theta. The maximum over theta is found exactly by sorting the end points and
sweeping over them, for many independent groups (one per z, or per cell of z) at once.
"""

from __future__ import annotations

import numpy as np

from ..surface.mesh import Floats, Integers

TURN = 2 * np.pi
Steps = tuple[Integers, Floats, Floats]
"""Owner (group * points + point), angle in [0, 2 pi], and rise of each step."""


def stab(
    group: Integers, point: Integers, centre: Floats, half_width: Floats, weight: Floats, groups: int, points: int
) -> tuple[Floats, Floats]:
    """Return the greatest weight that one rotation stabs, and that rotation, for each group of arcs.

    Parameters
    ----------
    group, point : (n,) int
        Group of each arc and its source point; arcs of one point in one group count once, with the largest weight.
    centre, half_width : (n,) float64
        The closed arc [centre - half_width, centre + half_width], radians; a half-width >= pi is the full circle.
    weight : (n,) float64
        Multiples of `Matching.unit`, so that every sum is exact.
    groups, points : int
        Number of groups and of source points.

    Returns
    -------
    values : (groups,) float64
        0 for a group without arcs.
    rotations : (groups,) float64
        In [0, 2 pi]: the middle of a stretch where the value is attained.
    """
    return swept(*envelope(group, point, centre, half_width, weight, points), groups, points)


def envelope(
    group: Integers, point: Integers, centre: Floats, half_width: Floats, weight: Floats, points: int
) -> Steps:
    """Return the steps that the largest weight of each source point takes in each group, as theta grows.

    The parameters are those of `stab`. All arcs of one point in one group must be among them.
    """
    if len(group) == 0:
        return np.zeros(0, np.intp), np.zeros(0), np.zeros(0)
    return _envelope(*_unrolled(group * points + point, centre, half_width, weight))


def swept(owner: Integers, theta: Floats, rise: Floats, groups: int, points: int) -> tuple[Floats, Floats]:
    """Return what `stab` does, from the steps of all its source points in any order but for those of each."""
    values, rotations = np.zeros(groups), np.zeros(groups)
    if len(owner) == 0:
        return values, rotations
    event_group, event_theta, event_rise = owner // points, theta, rise

    # rises before falls at equal angles: the arcs are closed
    order = np.lexsort([event_rise < 0, event_theta, event_group])
    event_group, event_theta, event_rise = event_group[order], event_theta[order], event_rise[order]
    level = np.cumsum(event_rise)
    first = np.flatnonzero(np.diff(event_group, prepend=-1))
    # each group's rises and falls cancel, so that the running sum starts from 0 in every group
    best = np.maximum.reduceat(level, first)
    present = event_group[first]
    values[present] = best
    attained = np.flatnonzero(level == np.repeat(best, np.diff(np.append(first, len(level)))))
    until = event_theta[np.minimum(attained + 1, len(level) - 1)]
    width = np.where(event_rise[attained] > 0, until - event_theta[attained], 0)
    # the widest stretch of each group last, so that it is the one that stays
    order = np.lexsort([width, event_group[attained]])
    attained = attained[order]
    rotations[event_group[attained]] = event_theta[attained] + 0.5 * width[order]
    return values, rotations


def _unrolled(
    owner: Integers, centre: Floats, half_width: Floats, weight: Floats
) -> tuple[Integers, Floats, Floats, Floats]:
    """Cut arcs at angle 0 into closed intervals of [0, 2 pi]."""
    full = half_width >= np.pi
    start = np.where(full, 0.0, np.mod(centre - half_width, TURN))
    stop = np.where(full, TURN, start + 2 * half_width)
    over = np.flatnonzero(stop > TURN)
    return (
        np.concatenate([owner, owner[over]]),
        np.concatenate([start, np.zeros(len(over))]),
        np.concatenate([np.minimum(stop, TURN), stop[over] - TURN]),
        np.concatenate([weight, weight[over]]),
    )


def _envelope(owner: Integers, start: Floats, stop: Floats, weight: Floats) -> Steps:
    """Return owner, angle and rise of the step function max {weight : theta in interval}, per owner."""
    n = len(owner)
    theta = np.concatenate([start, stop])
    falling = np.zeros(2 * n, bool)
    falling[n:] = True
    both = np.concatenate([owner, owner])
    order = np.lexsort([falling, theta, both])
    rank = np.empty(2 * n, np.intp)
    rank[order] = np.arange(2 * n)
    # slot s lies between events s and s + 1; an interval covers the slots from its start to before its stop. The
    # maximum over all intervals on each slot comes from a sparse table, filled at two places per interval, pushed down
    low, length = rank[:n], rank[n:] - rank[:n]
    power = np.frexp(length.astype(np.float64))[1] - 1
    covered = np.zeros(2 * n)
    for p in range(int(power.max()), -1, -1):
        here = power == p
        np.maximum.at(covered, low[here], weight[here])
        np.maximum.at(covered, low[here] + length[here] - (1 << p), weight[here])
        if p > 0:  # covered[s] so far stands for slots s to s + 2^p - 1
            half = 1 << (p - 1)
            covered[half:] = np.maximum(covered[half:], covered[:-half].copy())
    both, theta = both[order], theta[order]
    before = np.concatenate([[0.0], covered[:-1]])
    rise = covered - np.where(np.diff(both, prepend=-1) != 0, 0.0, before)
    changed = rise != 0
    return both[changed], theta[changed], rise[changed]
