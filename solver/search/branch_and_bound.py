"""The globally optimal Möbius transformation by branch and bound over z, with the rotation found exactly for each z.

Le, Chin and Suter (2016), Algorithm 1, with the stopping rule that proves: the search ends when no cell that is left
can hold a better value than the one in hand.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from ..mobius import Mobius
from ..stages import SearchProgress
from ..surface.mesh import Complexes, Floats, Integers
from .kernels import kernels_for
from .kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y, whole_disc
from .matching import Matching, matching

CELLS_AT_ONCE = 64
"""Open cells taken on in one round, the best bounds first."""

CENTRES = 16
"""Cells of a round at whose centres a better transformation is looked for: more find it hardly earlier."""

SHARES = 8
"""Parts that a round is dealt out in, whatever the number of threads, so that it finds the same with any."""

FRONTIER = 1 << 18
"""Open cells, 64 bytes each, beyond which the smallest are searched first: then the search is depth first, and adds
few more: those that one round leaves."""

NEAR = 1 / 16
"""Turns that rotations near a good one spread over."""

SMALLEST_CELL = 2.0**-38
"""Half side of a cell that is not split further; what its bound leaves open is reported as a gap."""


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The outcome of a search, complete or not.

    Attributes
    ----------
    mobius : Mobius
        The best transformation found.
    value : float
        Its Q, recomputed from the definition.
    upper_bound : float
        No transformation with |z| <= z_max has a larger Q.
    certified : bool
        value == upper_bound: the transformation is globally optimal.
    nodes : int
        Cells whose bound was computed.
    seconds : float
        Wall-clock time.
    matches : (p, 2) int
        A (source point, target point) pair for each matched source point.
    cancelled : bool
        Whether the progress callback ended the search.
    one_to_one : float
        The greatest weight of pairs within reach under `mobius` that share neither source nor target point.
    kernels : str
        What computed the bounds: "compiled" or "numpy".
    """

    mobius: Mobius
    value: float
    upper_bound: float
    certified: bool
    nodes: int
    seconds: float
    matches: Integers
    cancelled: bool = False
    one_to_one: float = 0.0
    kernels: str = ""

    @property
    def gap(self) -> float:
        """How much better a transformation could still be: upper_bound - value."""
        return self.upper_bound - self.value


def search(
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
) -> SearchResult:
    """Find the Möbius transformation that brings the greatest weight of source points into match discs of the target.

    Parameters
    ----------
    source : (N1,) complex
        Points of the closed unit disc.
    target : (N2,) complex
        Points of the closed unit disc; of the open one for the hyperbolic metric.
    radius : float or (N2,) float
        Radius of the match discs in the metric; hyperbolic: |x - b| / |1 - conj(b) x| <= radius < 1.
    metric : str
        "hyperbolic" (invariant under Möbius transformations) or "euclidean" (the paper's).
    weights : (N1, N2) float, optional
        In [0, 1]; 0 means incompatible. Rounded to multiples of 2^-20 or less (`Matching.unit`). Default: all 1.
    z_max : float
        Bound on |z|, in (0, 1).
    reflect : bool
        Search the transformations of the conjugated source as well.
    time_limit : float, optional
        Seconds after which the best so far is returned, with the bound proved by then.
    threads : int, optional
        At most; default: one per processor. The result does not depend on it, unless time runs out.
    progress : callable, optional
        Called a few times a second with a `SearchProgress`; returns False to end the search.

    Returns
    -------
    SearchResult
        Valid at whatever moment the search ended.

    Raises
    ------
    ValueError
        Wrong shapes or values out of range; the text names which.

    Notes
    -----
    Memory: some `FRONTIER` open cells of 64 bytes are kept, 16 MB. When there are more, the smallest are taken on
    instead of the best, depth first, until there are fewer. On top come 8 MB per thread for lists of pairs, and a
    raster of the target: up to 17 MB if all pairs may match, else 16 kB per source point, up to 128 MB.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> source = 0.9 * np.sqrt(rng.random(12)) * np.exp(2j * np.pi * rng.random(12))
    >>> found = search(source, Mobius(0.3 + 0.2j, 1.0)(source), 0.01)
    >>> found.value, found.certified
    (12.0, True)
    """
    if not 0 < z_max < 1:
        raise ValueError(f"z_max must lie between 0 and 1, not {z_max}")
    if time_limit is not None and not time_limit >= 0:
        raise ValueError(f"time_limit must be a number of seconds, not {time_limit}")
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be at least 1, not {threads}")
    plain = matching(source, target, radius, metric=metric, weights=weights)
    sides = [plain, plain.reflected()] if reflect else [plain]
    return _Search(sides, z_max).run(time_limit, threads or os.cpu_count() or 1, progress)


class _Search:
    """The state of one search: the best transformation so far, and the cells that may hold a better one."""

    def __init__(self, sides: list[Matching], z_max: float) -> None:
        self.sides, self.z_max = sides, z_max
        self.kernels = [kernels_for(problem, z_max, SMALLEST_CELL) for problem in sides]
        self.frontier = [whole_disc(problem.limit) for problem in sides]
        self.best, self.best_side = Mobius(), 0
        self.value = sides[0].value(self.best)
        self.finished_bound = -np.inf  # of cells too small to split
        self.nodes = 0

    @property
    def upper_bound(self) -> float:
        """What no transformation exceeds."""
        return max(self.value, self.finished_bound, *(open_[:, BOUND].max(initial=-np.inf) for open_ in self.frontier))

    def run(
        self, time_limit: float | None, threads: int, progress: Callable[[SearchProgress], bool | None] | None
    ) -> SearchResult:
        """Split cells, best bound first, until none can hold a better transformation or time is up."""
        started = reported = time.perf_counter()
        cancelled, rounds = False, 0
        # bounds per open cell and round: few at first, as the best bounds lead to a good value; more later, so that a
        # long search does not spend its time here
        most = int(np.clip(2**14 // len(self.sides[0].source), 8, 256))
        with ThreadPoolExecutor(threads) if threads > 1 else nullcontext() as pool:
            # cells that ended undecided may turn out worthless: another may yet reach their bound
            while any(map(len, self.frontier)):
                now = time.perf_counter()
                if time_limit is not None and now - started > time_limit:
                    break
                if progress is not None and now - reported > 0.1:
                    reported = now
                    if progress(SearchProgress(self.value, self.upper_bound, self.nodes, now - started)) is False:
                        cancelled = True
                        break
                self._round(min(8 << rounds // 32, most), pool)
                rounds += 1
        problem = self.sides[self.best_side]
        plain = Mobius(self.best.z, self.best.theta)
        upper = self.upper_bound
        return SearchResult(
            mobius=self.best,
            value=self.value,
            upper_bound=upper,
            certified=bool(upper == self.value),
            nodes=self.nodes,
            seconds=time.perf_counter() - started,
            matches=problem.matches(plain),
            cancelled=cancelled,
            one_to_one=one_to_one(problem, plain),
            kernels=self.kernels[0].name,
        )

    def _round(self, budget: int, pool: ThreadPoolExecutor | None) -> None:
        """Take the best open cells off the frontier, search in each for a while, and put back what is left of them."""
        bounds = np.concatenate([open_[:, BOUND] for open_ in self.frontier])
        full = len(bounds) > FRONTIER
        rank = np.concatenate([open_[:, HALF] for open_ in self.frontier]) if full else -bounds
        taken = np.zeros(len(bounds), bool)
        count = min(CELLS_AT_ONCE, len(bounds))
        taken[np.argpartition(rank, count - 1)[:count]] = True
        first = 0
        for side, open_ in enumerate(self.frontier):
            chosen = taken[first : first + len(open_)]
            first += len(open_)
            cells = open_[chosen]
            if len(cells) == 0:
                continue
            left = self._expanded(side, cells[np.argsort(-cells[:, BOUND], kind="stable")], budget, pool)
            self._improve(side, left)
            self.frontier[side] = np.concatenate([open_[~chosen], left])
        for side, open_ in enumerate(self.frontier):
            alive = open_[open_[:, BOUND] > self.value]
            ended = alive[:, HALF] <= SMALLEST_CELL
            self.finished_bound = max(self.finished_bound, alive[ended, BOUND].max(initial=-np.inf))
            self.frontier[side] = alive[~ended]

    def _expanded(self, side: int, cells: Floats, budget: int, pool: ThreadPoolExecutor | None) -> Floats:
        """Return what is left of cells after splitting each for a while; the threads share the work."""
        kernels, value = self.kernels[side], self.value
        shares = [cells[k::SHARES] for k in range(min(SHARES, len(cells)))]
        run = pool.map if pool else map
        parts = list(run(lambda share: kernels.expand(share, value, budget), shares))
        self.nodes += sum(spent for _, spent in parts)
        return np.concatenate([left for left, _ in parts])

    def _improve(self, side: int, left: Floats) -> None:
        """Look for a better transformation at the centres of the most promising cells, then around the best of them."""
        kernels = self.kernels[side]
        inside = left[np.hypot(left[:, X], left[:, Y]) <= self.z_max]
        inside = inside[np.argsort(-inside[:, BOUND], kind="stable")[:CENTRES]]
        z = inside[:, X] + 1j * inside[:, Y]
        if len(z) == 0:
            return
        # at the centre of a cell the window's angles are the rotations themselves
        values, rotations = kernels.rotations(z, self.value, inside[:, [FROM, WIDTH]])
        k = int(np.argmax(values))
        if values[k] <= self.value:
            return
        z, value, theta = complex(z[k]), float(values[k]), float(rotations[k])
        # a pattern search: the value is a step function, so there is no slope to follow
        step = float(inside[:, HALF].max())
        ring: Complexes = np.exp(2j * np.pi * np.arange(8) / 8)
        while step > 1e-4:
            around: Complexes = z + step * (1 - abs(z) ** 2) * ring
            around = around[np.abs(around) <= self.z_max]
            near = np.tile([theta / (2 * np.pi) - 0.5 * NEAR, NEAR], (len(around), 1))
            values, rotations = kernels.rotations(around, value, near)
            k = int(np.argmax(values)) if len(values) else -1
            if k >= 0 and values[k] > value:
                z, value, theta = complex(around[k]), float(values[k]), float(rotations[k])
            else:
                step /= 2
        found = Mobius(z, theta)
        value = self.sides[side].value(found)
        if value > self.value:
            self.value, self.best_side = value, side
            self.best = Mobius(found.z, found.theta, side == 1)


def one_to_one(problem: Matching, mobius: Mobius) -> float:
    """Return the greatest weight of pairs within reach that share neither source nor target point."""
    hits = problem.hits(mobius)
    j, k = problem.point[hits], problem.target[hits]
    if len(hits) == 0:
        return 0.0
    rows, row = np.unique(j, return_inverse=True)
    columns, column = np.unique(k, return_inverse=True)
    table = np.zeros((len(rows), len(columns)))
    table[row, column] = problem.weight[hits]
    return float(table[linear_sum_assignment(table, maximize=True)].sum())
