"""Which maps between specimens are wrong: round three of them, every point should come back to where it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..surface.mesh import Booleans, Floats, Integers
from .chart import ChartMap, Step, carried_along

Edge = tuple[int, int]
"""Numbers of the specimens of a pair: of source and target."""

SUSPECT = 0.09
"""Share of the diagonal from which on a map is suspect. One that is right errs by less than 0.03, as everywhere in this
project; round three of them a point comes back within three times as much."""

SHARPER = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""How much a map's own error discounts the cycles that it is in, per `SUSPECT`, round after round: none is known to be
wrong at first, so that each counts, and in the end those that are wrong by more than a fraction of it hardly do."""

MOST_TRIANGLES = 20_000
"""Triangles that are walked, at most: their number grows with the cube of that of the surfaces."""


def triangles(edges: Sequence[Edge], most: int = MOST_TRIANGLES, seed: int = 0) -> Integers:
    """Return the triangles that pairs form, (t, 3) int, ascending; of more than `most` a random sample.

    The sample is drawn for each pair alike: every one that is in a triangle keeps some.
    """
    near: dict[int, set[int]] = {}
    for a, b in edges:
        near.setdefault(a, set()).add(b)
        near.setdefault(b, set()).add(a)
    rng = np.random.default_rng(seed)
    found: set[tuple[int, int, int]] = set()
    # one round per pair and one triangle per round, until there are enough
    thirds = [sorted(near[a] & near[b]) for a, b in edges]
    if sum(map(len, thirds)) <= 3 * most:
        found = {_ascending(a, b, c) for (a, b), others in zip(edges, thirds, strict=True) for c in others}
    else:
        for others in thirds:
            rng.shuffle(others)
        rank = 0
        while len(found) < most:
            for (a, b), others in zip(edges, thirds, strict=True):
                if rank < len(others) and len(found) < most:
                    found.add(_ascending(a, b, others[rank]))
            rank += 1
    return np.array(sorted(found), np.intp).reshape(-1, 3)


def _ascending(a: int, b: int, c: int) -> tuple[int, int, int]:
    first, second, third = sorted((a, b, c))
    return first, second, third


def step(maps: Mapping[Edge, ChartMap], start: int, end: int) -> Step:
    """Return the map from one specimen to another, in whichever direction it was found."""
    if (start, end) in maps:
        return Step(maps[start, end], backward=False)
    return Step(maps[end, start], backward=True)


def closing_error(maps: Mapping[Edge, ChartMap], cycle: Sequence[int]) -> float:
    """Return how far points come to lie from where they were, round specimens, on average, in diagonals of the first.

    Of those that have counterparts all the way; nan where none has. 1 where the cycle turns orientation round, which
    nothing can be further from.
    """
    path = [step(maps, a, b) for a, b in zip(cycle, [*cycle[1:], cycle[0]], strict=True)]
    if sum(s.map.mobius.reflected for s in path) % 2:
        return 1.0
    chart = path[-1].end
    back, known = carried_along(chart.places[chart.samples], path)
    if not known.any():
        return np.nan
    apart = np.linalg.norm(chart.positions(back) - chart.vertices[chart.samples], axis=1)
    return float(apart[known].mean() / chart.diagonal)


def edge_errors(edges: Sequence[Edge], cycles: Integers, errors: Floats) -> Floats:
    """Return how wrong each map is by the triangles that it is in, (e,); nan where it is in none.

    Lerman and Shi, "Robust Group Synchronization via Cycle-Edge Message Passing" (2022): the mean of a map's cycle
    errors, in which a cycle counts the less the more wrong the other two maps in it are, found by repetition.

    Parameters
    ----------
    edges : sequence of (int, int)
    cycles : (t, 3) int
        Triangles of specimens, ascending.
    errors : (t,) float64
        How far from closed each is.
    """
    number = {tuple(sorted(edge)): k for k, edge in enumerate(edges)}
    sides = np.array([[number[a, b], number[b, c], number[a, c]] for a, b, c in cycles.tolist()], np.intp).reshape(
        -1, 3
    )
    members = np.bincount(sides.ravel(), minlength=len(edges))
    result = np.bincount(sides.ravel(), np.repeat(errors, 3), len(edges)) / np.maximum(members, 1)
    for sharp in SHARPER:
        known = result[sides]
        others = known.sum(axis=1, keepdims=True) - known
        # relative to the best cycle of each map: where all others are wrong, the least wrong counts
        least = np.full(len(edges), np.inf)
        np.minimum.at(least, sides.ravel(), others.ravel())
        weight = np.exp(-sharp * (others - least[sides]) / SUSPECT)
        total = np.bincount(sides.ravel(), weight.ravel(), len(edges))
        result = np.bincount(sides.ravel(), (weight * errors[:, None]).ravel(), len(edges)) / np.maximum(total, 1e-300)
    return np.where(members > 0, result, np.nan)


def suspect(errors: Floats) -> Booleans:
    """Return which maps are suspect, (e,), by their `edge_errors`: those in no triangle are not."""
    return np.nan_to_num(errors, nan=0.0) > SUSPECT


def specimen_errors(count: int, edges: Sequence[Edge], errors: Floats) -> Floats:
    """Return the mean of the errors of the maps that each specimen is in, (count,); nan where none is known."""
    total, number = np.zeros(count), np.zeros(count)
    for edge, error in zip(edges, errors, strict=True):
        if np.isfinite(error):
            total[list(edge)] += error
            number[list(edge)] += 1
    return np.divide(total, number, out=np.full(count, np.nan), where=number > 0)
