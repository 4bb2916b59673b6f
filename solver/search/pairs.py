"""Which pairs of points may match, where these are not all: their list, in 8 bytes a pair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

PAIRS_AT_ONCE = 1 << 16
"""Pairs looked at in one go: a few milliseconds' work, after which a search may be called off."""

MOST_PAIRS = (1 << 32) - 1
"""Numbers of pairs are kept in 32 bits."""


def nothing() -> None:
    """Do nothing: what is called where nobody wants to be asked."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Which target points each source point may match, where these are not all of them.

    Attributes
    ----------
    start : (N1 + 1,) int64
        Where the pairs of each source point begin.
    target : (P,) int32
        Target point of each pair, ascending within a row.
    units : (P,) uint32 or None
        Weight of each pair in `Matching.unit`, > 0; None: all 1.
    """

    start: npt.NDArray[np.int64]
    target: npt.NDArray[np.int32]
    units: npt.NDArray[np.uint32] | None


def rows_of(
    table: npt.NDArray[np.generic], shape: tuple[int, int], check: Callable[[], None]
) -> tuple[Rows | None, float]:
    """Check the weights of all pairs and return those above 0, and the unit that they are rounded to."""
    if table.shape != shape:
        raise ValueError(f"weights must be of shape {shape}, not {table.shape}")
    some = max(PAIRS_AT_ONCE // shape[1], 1)
    blocks = [slice(first, first + some) for first in range(0, shape[0], some)]
    plain = full = True
    most = 0
    for block in blocks:
        check()
        part = np.asarray(table[block], dtype=np.float64)
        if not (part.min() >= 0 and part.max() <= 1):  # false for nan
            raise ValueError("every weight must lie in [0, 1]")
        ones, some = part == 1, part > 0
        most += int(np.count_nonzero(some))
        full = full and bool(ones.all())
        plain = plain and bool((ones == some).all())
    if full:
        return None, 1.0
    if most > MOST_PAIRS:
        raise too_many(most)
    unit = 1.0 if plain else 2.0 ** (shape[0].bit_length() - 31)
    # filled block by block, so that no step is long
    counts, target = np.zeros(shape[0] + 1, np.int64), np.empty(most, np.int32)
    units, first = None if plain else np.empty(most, np.uint32), 0
    for block in blocks:
        check()
        part = np.round(np.asarray(table[block], dtype=np.float64) / unit)
        j, k = np.nonzero(part)
        last = first + len(j)
        counts[1:][block] = np.bincount(j, minlength=len(part))
        target[first:last] = k
        if units is not None:
            units[first:last] = part[j, k]
        first = last
    return Rows(np.cumsum(counts), target[:first], None if units is None else units[:first]), unit


def too_many(count: int) -> ValueError:
    """Return the sentence for who wants more than `MOST_PAIRS`."""
    return ValueError(
        f"{count:,} pairs may match, more than the {MOST_PAIRS:,} that a search can hold: "
        "take fewer points, or weights of 0 for pairs that cannot match"
    )
