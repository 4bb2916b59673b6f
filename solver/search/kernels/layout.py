"""How the compiled kernels want pairs and discs to lie in memory: 12 bytes a pair, or one row for all source points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...surface.mesh import Floats, Integers
from ..matching import Matching


def one_row(problem: Matching) -> Integers | None:
    """Return the target points that every source point may match with weight 1, or None if there is no such row."""
    if problem.rows is None:
        return np.arange(len(problem.centres))
    count, width = len(problem.source), problem.count // len(problem.source)
    if problem.unit != 1 or (np.diff(problem.starts) != width).any():
        return None
    targets = problem.rows.target.reshape(count, width)
    return targets[0].astype(np.intp) if (targets == targets[0]).all() else None


def own_rows(
    problem: Matching, inner: Floats, outer: Floats, widest: Floats, check: Callable[[], None]
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, float]:
    """Return disc, running maximum of outer, rounded up, and weight of each pair, in an order by inner in each row.

    And the median of `widest` over all pairs.
    """
    assert problem.rows is not None
    target, units, starts = problem.rows.target, problem.rows.units, problem.starts
    disc, reach = np.empty(len(target), np.uint32), np.empty(len(target), np.float32)
    weight = None if problem.unit == 1 or units is None else np.empty(len(target), np.uint32)
    often = np.zeros(len(widest), np.int64)
    for first, last in problem.blocks():
        check()
        a, b = int(starts[first]), int(starts[last])
        some = target[a:b]
        often += np.bincount(some, minlength=len(often))
        order = np.lexsort([inner[some], np.repeat(np.arange(last - first), np.diff(starts[first : last + 1]))])
        disc[a:b] = some[order]
        if weight is not None and units is not None:
            weight[a:b] = units[a:b][order]
        far = outer[disc[a:b]].astype(np.float32)
        reach[a:b] = np.where(far < outer[disc[a:b]], np.nextafter(far, np.float32(np.inf)), far)
    # pairs before the first entry of a row that is >= near cannot reach near
    for number, (a, b) in enumerate(zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)):
        if number % 256 == 0:
            check()
        np.maximum.accumulate(reach[a:b], out=reach[a:b])
    return disc, reach, weight, _median(widest, often)


def _median(x: Floats, often: np.ndarray) -> float:
    """Return the median of numbers that occur so often; 1 if none does."""
    order = np.argsort(x)
    upto = np.cumsum(often[order])
    if upto[-1] == 0:
        return 1.0
    return float(np.mean(x[order[np.searchsorted(upto, [(upto[-1] - 1) // 2, upto[-1] // 2], side="right")]]))


def sectors(b: Floats, turn: Floats, rings: int) -> np.ndarray:
    """Return the number of the sector of the grid that each target point lies in, ring by ring."""
    ring, sectors = np.minimum((b * rings).astype(np.int64), rings - 1), 2 * rings
    return ring * sectors + np.minimum(((turn - np.floor(turn)) * sectors).astype(np.int64), sectors - 1)


def sector_grid(
    b: Floats, turn: Floats, inner: Floats, outer: Floats, widest: Floats, rings: int
) -> dict[str, np.ndarray]:
    """Return where each sector's target points begin, and what rings of the grid a ring of images has to look at."""
    number = sectors(b, turn, rings)
    ring = number // (2 * rings)
    wide = np.zeros(rings)
    np.maximum.at(wide, ring, widest)
    # of the discs that reach out to a ring or beyond the innermost, of those that reach into it or below the outermost
    nearest, farthest = np.full(rings, rings, np.int64), np.full(rings, -1, np.int64)
    np.minimum.at(nearest, np.clip(np.floor(outer * rings), 0, rings - 1).astype(np.int64), ring)
    np.maximum.at(farthest, np.clip(np.floor(inner * rings), 0, rings - 1).astype(np.int64), ring)
    return {
        "grid": np.searchsorted(number, np.arange(2 * rings**2 + 1)).astype(np.int64),
        "nearest_ring": np.minimum.accumulate(nearest[::-1])[::-1],
        "farthest_ring": np.maximum.accumulate(farthest),
        "ring_wide": wide,
    }
