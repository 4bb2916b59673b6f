"""The state of a search by branch and bound: the best transformation so far, and the cells that may hold a better one.

What is in hand counts only what is matched in exact arithmetic (`matching`), and no |z| that exceeds z_max in it;
bounds hold for all that may be (`bounds`). So where an optimum is reached on the rim of a disc alone, value and bound
stay apart, and the gap says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from fractions import Fraction
from typing import Any

import numpy as np

from ..mobius import Mobius
from ..stages import SearchProgress
from ..surface.mesh import Booleans, Complexes, Floats, Integers
from .kernels import kernels_for
from .kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y, whole_disc
from .outcome import TRACED, SearchResult
from .watch import look

CELLS_AT_ONCE = 64
"""Open cells taken on in one round, the best bounds first."""

CENTRES = 16
"""Cells of a round at whose centres a better transformation is looked for: more find it hardly earlier."""

SHARES = 8
"""Parts that a round is dealt out in, whatever the number of threads, so that it finds the same with any."""

FRONTIER = 1 << 18
"""Open cells, 64 bytes each, beyond which the smallest are searched first: then the search is depth first, and adds
few more: those that one round leaves."""

HANDED_OVER = 1e-3
"""Seconds of a round from which other threads take part in the next."""

NEAR = 1 / 16
"""Turns that rotations near a good one spread over."""

SMALLEST_CELL = 2.0**-38
"""Half side of a cell that is not split further; what its bound leaves open is reported as a gap."""


class Search:
    """The state of one search: the best transformation so far, and the cells that may hold a better one."""

    identity: Any = Mobius()
    bound_at, half_at = BOUND, HALF
    """Columns of a cell's bound and half side."""
    at_once = CELLS_AT_ONCE

    def __init__(self, z_max: float, limit: float, until: Callable[[float, float, int], bool]) -> None:
        self.z_max, self.until = z_max, until
        self.halt = np.zeros(1, np.int32)
        self.sides: list[Any] = []  # of `Matching`
        self.kernels: list[Any] = []
        self.frontier: list[Floats] = []
        self.best: Any = self.identity
        self.best_side = 0
        self.value = 0.0
        self.floor = -np.inf  # what is worth no more is not looked for
        self.matches: Integers = np.zeros((0, 2), np.intp)
        self.unlooked = limit  # what is not known to be impossible before there is a frontier
        self.finished_bound = -np.inf  # of cells too small to split
        self.nodes = 0
        self.proved = 0.0, limit, 0
        self.started, self.trace = time.perf_counter(), list[SearchProgress]()
        self.slow = False
        self.ended = self.out_of_time = False

    def check(self) -> None:
        """Raise Halted if the search is called off."""
        look(self.halt)

    @property
    def least(self) -> float:
        """What a transformation has to exceed."""
        return max(self.value, self.floor)

    @property
    def upper_bound(self) -> float:
        """What no transformation exceeds."""
        tops = [open_[:, self.bound_at].max(initial=-np.inf) for open_ in self.frontier]
        return float(max(self.least, self.unlooked, self.finished_bound, *tops))

    def progress(self, seconds: float) -> SearchProgress:
        """Return what was proved when the last round ended."""
        return SearchProgress(*self.proved, seconds)

    def result(self, seconds: float, cancelled: bool) -> SearchResult:
        """Return the outcome, wherever the search has been called off."""
        upper, best = self.upper_bound, self.best
        return SearchResult(
            mobius=best,
            value=self.value,
            upper_bound=upper,
            certified=upper == self.value,
            nodes=self.nodes,
            seconds=seconds,
            matches=self.matches,
            cancelled=cancelled,
            out_of_time=self.out_of_time or not (self.ended or cancelled),
            kernels=self.kernels[0].name if self.kernels else "",
            trace=(*self.trace, SearchProgress(self.value, upper, self.nodes, seconds)),
            counted=(self.sides[self.best_side], self._plain(best)) if self.sides else None,
        )

    def _plain(self, best: Any) -> Any:
        """Return a transformation without its reflection."""
        return Mobius(best.z, best.theta)

    def begin(self, plain: Any, reflect: bool) -> None:
        """Set up what the search needs; kernels that it has already are taken."""
        self.sides = [plain, plain.reflected()] if reflect else [plain]
        self.unlooked = plain.limit
        self.value, self.matches = plain.evaluated(self.best, self.check)
        self.kernels = self.kernels or [kernels_for(plain, self.z_max, SMALLEST_CELL, self.halt)]
        if reflect:
            self.kernels.append(self.kernels[0].reflected())
        self.frontier = [whole_disc(problem.limit) for problem in self.sides]
        self.unlooked = -np.inf

    def run(self, deadline: float, threads: int) -> None:
        """Split cells, best bound first, until none can hold a better transformation, it is enough, or time is up."""
        for _ in self.rounds(deadline, threads):
            pass

    def rounds(self, deadline: float, threads: int) -> Iterator[None]:
        """Do the same, and yield after every round."""
        rounds = 0
        # bounds per open cell and round: few at first, as the best bounds lead to a good value; more later, so that a
        # long search does not spend its time here
        most = int(np.clip(2**14 // len(self.sides[0].source), 8, 256))
        with ThreadPoolExecutor(threads) if threads > 1 else nullcontext() as pool:
            # cells that ended undecided may turn out worthless: another may yet reach their bound
            while any(map(len, self.frontier)):
                self.proved = self.value, self.upper_bound, self.nodes
                self._traced()
                if self.until(*self.proved):
                    break
                if time.perf_counter() > deadline:
                    self.out_of_time = True
                    break
                self.check()
                self._round(min(8 << rounds // 32, most), pool)
                rounds += 1
                yield
        self.ended = True

    def _traced(self) -> None:
        """Note what is proved, unless it is hardly more than what was noted last."""
        value, bound, nodes = self.proved
        last = self.trace[-1] if self.trace else None
        if last is None or value > last.value or bound - value < (last.upper_bound - last.value) * (1 - TRACED):
            self.trace.append(SearchProgress(value, bound, nodes, time.perf_counter() - self.started))

    def _round(self, budget: int, pool: ThreadPoolExecutor | None) -> None:
        """Take the best open cells off the frontier, search in each for a while, and put back what is left of them."""
        bounds = np.concatenate([open_[:, self.bound_at] for open_ in self.frontier])
        full = len(bounds) > FRONTIER
        rank = np.concatenate([open_[:, self.half_at] for open_ in self.frontier]) if full else -bounds
        taken = np.zeros(len(bounds), bool)
        count = min(self.at_once, len(bounds))
        taken[np.argpartition(rank, count - 1)[:count]] = True
        first = 0
        for side, open_ in enumerate(self.frontier):
            chosen = taken[first : first + len(open_)]
            first += len(open_)
            cells = open_[chosen]
            if len(cells) == 0:
                continue
            cells = cells[np.argsort(-cells[:, self.bound_at], kind="stable")]
            left = self._expanded(side, cells, budget, pool)
            self.frontier[side] = np.concatenate([open_[~chosen], self._open(left)])
            self._improve(side, left)
        self.close()

    def close(self) -> None:
        """Take off the frontier what cannot hold a better transformation, or is too small to be split."""
        self.frontier = [self._open(cells) for cells in self.frontier]

    def _open(self, cells: Floats) -> Floats:
        """Return the cells that are to be split further; what too small ones leave open is noted."""
        alive = cells[:, self.bound_at] > self.least
        ended = alive & self._settled(cells)
        self.finished_bound = max(self.finished_bound, cells[ended, self.bound_at].max(initial=-np.inf))
        stay = alive & ~ended
        return cells if stay.all() else cells[stay]  # a frontier is large, and mostly stays

    def _settled(self, cells: Floats) -> Booleans:
        """Return which cells are not split further: what their bounds leave open is reported as a gap."""
        return cells[:, self.half_at] <= SMALLEST_CELL

    def _expanded(self, side: int, cells: Floats, budget: int, pool: ThreadPoolExecutor | None) -> Floats:
        """Return what is left of cells after splitting each for a while; the threads share the work."""
        kernels, limits = self.kernels[side], self._limits()
        shares = [cells[k::SHARES] for k in range(min(SHARES, len(cells)))]
        begun = time.perf_counter()
        run = pool.map if pool and self.slow else map
        parts = list(run(lambda share: kernels.expand(share, *limits, budget), shares))
        # what is done sooner than it is handed over is not handed over
        self.slow = time.perf_counter() - begun > HANDED_OVER
        self.nodes += sum(spent for _, spent in parts)
        return np.concatenate([left for left, _ in parts])

    def _limits(self) -> tuple[float, ...]:
        """Return what bounds are held against."""
        return (self.least,)

    def _improve(self, side: int, left: Floats) -> None:
        """Look for a better transformation at the centres of the most promising cells, then around the best of them."""
        kernels = self.kernels[side]
        inside = left[np.hypot(left[:, X], left[:, Y]) <= self.z_max]
        inside = inside[np.argsort(-inside[:, BOUND], kind="stable")[:CENTRES]]
        z = inside[:, X] + 1j * inside[:, Y]
        if len(z) == 0:
            return
        # at the centre of a cell the window's angles are the rotations themselves
        values, rotations = kernels.rotations(z, self.least, inside[:, [FROM, WIDTH]])
        k = int(np.argmax(values))
        if values[k] <= self.least:
            return
        z, value, theta = complex(z[k]), float(values[k]), float(rotations[k])
        # a pattern search: the value is a step function, so there is no slope to follow
        step = float(inside[:, HALF].max())
        ring: Complexes = np.exp(2j * np.pi * np.arange(8) / 8)
        while step > 1e-4:
            self.check()
            around: Complexes = z + step * (1 - abs(z) ** 2) * ring
            around = around[np.abs(around) <= self.z_max]
            near = np.tile([theta / (2 * np.pi) - 0.5 * NEAR, NEAR], (len(around), 1))
            values, rotations = kernels.rotations(around, value, near)
            k = int(np.argmax(values)) if len(values) else -1
            if k >= 0 and values[k] > value:
                z, value, theta = complex(around[k]), float(values[k]), float(rotations[k])
            else:
                step /= 2
        self._offer(side, Mobius(z, theta))

    def _offer(self, side: int, found: Any) -> None:
        """Take a transformation if it is better, and within the bound on |z| to its last digit."""
        value, matches = self.sides[side].evaluated(found, self.check)
        if value > self.value and within(found.z, self.z_max):
            self.value, self.matches, self.best_side = value, matches, side
            self.best = Mobius(found.z, found.theta, side == 1)


def within(z: complex, z_max: float) -> bool:
    """Return whether |z| <= z_max, exactly."""
    return Fraction(z.real) ** 2 + Fraction(z.imag) ** 2 <= Fraction(z_max) ** 2
