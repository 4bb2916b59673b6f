"""The kernels of the search on the sphere: boxes.c through ctypes, and the same in numpy."""

from __future__ import annotations

import ctypes
import threading
from typing import Any

import numpy as np

from ...mobius import spinors
from ...surface.mesh import Floats
from ..box_bounds import BOXES_AT_ONCE, bounds_of, caps_of, pair_coefficients
from ..matching import Matching
from ..pairs import MOST_PAIRS, too_many
from ..watch import Halt, look
from .boxes import BOUND, COLUMNS, LARGEST, MIDDLE, SIDES
from .compiled import library

LANES = 4
"""Pairs that boxes.c looks at together: rows begin at multiples of it."""

STACK = 512
"""Open boxes of one subtree at most, as in boxes.c."""

MOST_HELD = 1 << 22
"""Pairs whose coefficients are kept, 72 bytes each; of more they are computed whenever they are looked at."""

MOST_KNOWN = 256
"""Source points of which a box keeps which pairs need not be looked at, a byte each."""

ARENA = 1 << 20
"""Entries of lists that one thread can hold for the boxes it has open, 8 bytes each, or 32 for every source point."""

_I64, _F64, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


class _Problem(ctypes.Structure):
    _fields_ = [
        ("points", _I64),
        *((name, _POINTER) for name in ("source", "spinors", "start", "stop", "weight", "target", "caps", "pairs")),
        ("most", _F64),
        ("smallest", _F64),
        ("halt", _POINTER),
    ]


def most_of(h_max: float) -> float:
    """Return the bound on |v| / k that |h| <= h_max is, rounded up."""
    return 2 * h_max / (1 + h_max**2) * (1 + 2.0**-50)


class CompiledBoxKernels:
    """The kernels for one matching, in C; see `ReferenceBoxKernels` for the same in numpy.

    Attributes
    ----------
    width : int
        Columns of the rows that `expand` takes and returns.
    """

    name = "compiled"

    def __init__(self, problem: Matching, h_max: float, smallest: float, halt: Halt | None = None) -> None:
        loaded = library()
        if loaded is None:
            raise ImportError("mobius_kernels is not installed")
        self._library = loaded
        self.problem, self.h_max, self.smallest = problem, h_max, smallest
        self.unit, self.points = problem.unit, len(problem.source)
        self.halt = np.zeros(1, np.int32) if halt is None else halt
        caps = caps_of(problem)
        arrays: dict[str, np.ndarray | None] = {"halt": self.halt, "source": problem.source, "caps": caps}
        arrays["spinors"] = spinors(problem.source).view(np.float64)
        arrays |= _rows(problem, caps)
        # kept, because the structure holds bare addresses
        self._arrays = {name: None if x is None else np.ascontiguousarray(x) for name, x in arrays.items()}
        addresses = {name: None if x is None else x.ctypes.data for name, x in self._arrays.items()}
        self._problem = _Problem(points=self.points, most=most_of(h_max), smallest=smallest, **addresses)
        self.width = COLUMNS + -(-min(self.points, MOST_KNOWN) // 8)
        self._room = max(ARENA, 32 * self.points)
        self._local = threading.local()
        look(self.halt)

    def reflected(self) -> CompiledBoxKernels:
        """Return the kernels for the conjugated source."""
        return CompiledBoxKernels(self.problem.reflected(), self.h_max, self.smallest, self.halt)

    def _arena(self) -> int:
        """Return the address of this thread's lists."""
        if not hasattr(self._local, "arena"):
            self._local.arena = np.empty(self._room, np.uint64)
        return self._local.arena.ctypes.data

    def bounds(self, boxes: Floats, value: float = -np.inf) -> Floats:
        """Return what Q does not exceed in each box, (n,), and in boxes without extent is.

        Below 0: not above `value`, or no transformation is in the box.
        """
        given = np.array(boxes[:, :COLUMNS], dtype=np.float64, order="C")
        least = max(value / self.unit, -0.5)
        self._library.boxes_bounds(ctypes.addressof(self._problem), given.ctypes.data, len(given), least, self._arena())
        return given[:, BOUND] * self.unit

    def expand(self, boxes: Floats, value: float, enough: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of boxes after searching each, depth first, for `budget` bounds, and how many it took.

        Those whose bound is at most `value` are gone, those whose bound is at most `enough` are left as they are. If
        halted, the rest are. Columns beyond those of a box are the kernels' own, 0 at first.
        """
        given = np.array(boxes, dtype=np.float64, order="C")
        given[:, BOUND] /= self.unit
        counts = np.zeros(2, np.int64)
        room = np.empty((2 * (budget + STACK), self.width))
        parts, spent = [], 0
        while len(given):
            done = self._library.boxes_expand(
                ctypes.addressof(self._problem),
                given.ctypes.data,
                len(given),
                self.width,
                value / self.unit,
                enough / self.unit,
                budget,
                room.ctypes.data,
                len(room),
                counts.ctypes.data,
                self._arena(),
                self._room,
            )
            given = np.ascontiguousarray(given[done:])
            parts.append(room[: counts[0]].copy())
            spent += int(counts[1])
            if self.halt[0]:
                parts.append(given)
                break
        left = np.concatenate(parts) if parts else given
        left[:, BOUND] *= self.unit
        return left, spent


def _rows(problem: Matching, caps: Floats) -> dict[str, np.ndarray | None]:
    """Return the pairs as boxes.c wants them: a row for each source point, the heaviest first, or one row for all."""
    n1, n2 = len(problem.source), len(problem.centres)
    held = problem.count <= MOST_HELD
    if problem.rows is None and not held:
        filled = -(-n2 // LANES) * LANES
        target, weight = np.zeros((2, filled), np.uint32)
        target[:n2], weight[:n2] = np.arange(n2), 1
        ends = {"start": np.zeros(n1, np.int64), "stop": np.full(n1, n2, np.int64)}
        return ends | {"target": target, "weight": weight, "pairs": None}
    counts = np.diff(problem.starts)
    room = -(-counts // LANES) * LANES
    start = np.concatenate([[0], np.cumsum(room)[:-1]]).astype(np.int64)
    total = int(room.sum())
    if total > MOST_PAIRS:
        raise too_many(total)
    target, weight = np.zeros((2, total), np.uint32)
    for j, (first, last) in enumerate(zip(problem.starts[:-1].tolist(), problem.starts[1:].tolist(), strict=True)):
        units, at = np.ones(last - first, np.uint32), slice(int(start[j]), int(start[j]) + last - first)
        columns = np.arange(n2, dtype=np.uint32)
        if problem.rows is not None:
            columns = problem.rows.target[first:last]
            units = units if problem.rows.units is None else problem.rows.units[first:last]
        order = np.argsort(-units.astype(np.int64), kind="stable")
        target[at], weight[at] = columns[order], units[order]
    pairs = None
    if held:
        owner = np.repeat(np.arange(n1), room)
        c = pair_coefficients(spinors(problem.source)[owner], caps[target])
        numbers = np.column_stack([c.view(np.float64), caps[target, 4]])
        pairs = numbers.reshape(-1, LANES, 9).transpose(0, 2, 1)
    return {"start": start, "stop": start + counts, "target": target, "weight": weight, "pairs": pairs}


class ReferenceBoxKernels:
    """The kernels for one matching, in numpy."""

    name = "numpy"
    width = COLUMNS

    def __init__(self, problem: Matching, h_max: float, smallest: float, halt: Halt | None = None) -> None:
        self.problem, self.h_max, self.smallest = problem, h_max, smallest
        self.halt = np.zeros(1, np.int32) if halt is None else halt

    def reflected(self) -> ReferenceBoxKernels:
        """Return the kernels for the conjugated source."""
        return ReferenceBoxKernels(self.problem.reflected(), self.h_max, self.smallest, self.halt)

    def bounds(self, boxes: Floats, value: float = -np.inf) -> Floats:
        """Return what Q does not exceed in each box, (n,), and in boxes without extent is.

        Below 0: not above `value`, or no transformation is in the box.
        """
        some = max(BOXES_AT_ONCE // max(self.problem.count, 1), 1)
        found = [np.zeros(0)]
        for first in range(0, len(boxes), some):
            look(self.halt)
            found.append(bounds_of(self.problem, boxes[first : first + some], most_of(self.h_max)))
        bounds = np.concatenate(found)
        return np.where(bounds > value, bounds, -1)

    def expand(self, boxes: Floats, value: float, enough: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of boxes after halving them once, and how many bounds that took."""
        del budget
        through = boxes[:, BOUND] > enough
        halves = halved(boxes[through])
        bounds = np.minimum(self.bounds(halves), halves[:, BOUND])
        halves[:, BOUND] = bounds
        return np.concatenate([boxes[~through], halves[bounds > value]]), len(halves)


def halved(boxes: Floats) -> Floats:
    """Return the halves of boxes, (2 n, 15), cut where they are longest."""
    halves = np.repeat(boxes, 2, axis=0)
    rows, cut = np.arange(len(halves)), np.argmax(halves[:, SIDES], axis=1)
    halves[rows, SIDES.start + cut] /= 2
    half = halves[rows, SIDES.start + cut]
    halves[rows, MIDDLE.start + cut] += half * np.tile([-1.0, 1.0], len(boxes))
    halves[:, LARGEST] = halves[:, SIDES].max(axis=1)
    return halves


def box_kernels_for(
    problem: Matching, h_max: float, smallest: float, halt: Halt | None = None
) -> CompiledBoxKernels | ReferenceBoxKernels:
    """Return the fastest kernels there are for a matching; see `kernels_for`."""
    kind: Any = ReferenceBoxKernels if library() is None else CompiledBoxKernels
    return kind(problem, h_max, smallest, halt)
