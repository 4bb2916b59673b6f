"""The globally optimal Möbius transformation by branch and bound over z, with the rotation found exactly for each z.

Le, Chin and Suter (2016), Algorithm 1, with the stopping rule that proves: the search ends when no cell that is left
can hold a better value than the one in hand.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .bounds import enclosing_arcs, exact_arcs
from .matching import Matching, matching
from .mesh import Complexes, Floats, Integers
from .mobius import Mobius
from .stabbing import stab

CELLS_AT_ONCE = 64
"""Cells split in one round: enough to keep numpy busy, few enough to stay close to best-first order."""

SMALLEST_CELL = 2.0**-40
"""Half side of a cell that is not split further; what its bound leaves open is reported as a gap."""


@dataclass(frozen=True)
class SearchProgress:
    """What is proved so far: no transformation exceeds `upper_bound`, and one in hand reaches `value`."""

    value: float
    upper_bound: float
    nodes: int
    seconds: float


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
    """

    mobius: Mobius
    value: float
    upper_bound: float
    certified: bool
    nodes: int
    seconds: float
    matches: Integers
    cancelled: bool = False

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
        In [0, 1]; 0 means incompatible. Rounded to multiples of 2^-24. Default: all 1.
    z_max : float
        Bound on |z|, in (0, 1).
    reflect : bool
        Search the transformations of the conjugated source as well.
    time_limit : float, optional
        Seconds after which the best so far is returned, with the bound proved by then.
    threads : int, optional
        Has no effect on the result; this implementation uses one.
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
    return _branch_and_bound([plain, plain.reflected()] if reflect else [plain], z_max, time_limit, progress)


def _branch_and_bound(
    sides: list[Matching],
    z_max: float,
    time_limit: float | None,
    progress: Callable[[SearchProgress], bool | None] | None,
) -> SearchResult:
    """Search all `sides` (plain, reflected) at once, best bound first."""
    started = time.perf_counter()
    best, value = Mobius(), -1.0
    # entries: -bound, half side, side, centre; the sum of real numbers breaks ties the same way on every machine
    frontier: list[tuple[float, float, int, float, float]] = []
    for side, problem in enumerate(sides):
        heapq.heappush(frontier, (-problem.limit, 1.0, side, 0.0, 0.0))
        best, value = _better(best, value, *_improved(problem, np.zeros(1, np.complex128), side == 1))
    finished_bound = -np.inf  # of cells too small to split
    nodes, cancelled, reported = 0, False, started
    while frontier and -frontier[0][0] > value:
        now = time.perf_counter()
        if time_limit is not None and now - started > time_limit:
            break
        if progress is not None and now - reported > 0.1:
            reported = now
            if progress(SearchProgress(value, max(-frontier[0][0], finished_bound), nodes, now - started)) is False:
                cancelled = True
                break
        side = frontier[0][2]
        batch: list[tuple[float, float, int, float, float]] = []
        while frontier and len(batch) < CELLS_AT_ONCE and frontier[0][2] == side and -frontier[0][0] > value:
            batch.append(heapq.heappop(frontier))
        problem = sides[side]
        centre, half = _children(batch, z_max)
        if len(centre) == 0:
            continue
        bounds = cell_bounds(problem, centre, half)
        # a parent's bound holds for its children too; batch is a list of fours
        nodes += len(centre)
        alive = np.flatnonzero(bounds > value)
        if len(alive):
            inside = alive[np.abs(centre[alive]) <= z_max]
            promising = inside[np.argsort(-bounds[inside], kind="stable")[:CELLS_AT_ONCE]]
            if len(promising):
                best, value = _better(best, value, *_improved(problem, centre[promising], side == 1))
            alive = alive[bounds[alive] > value]
        for k in alive.tolist():
            if half[k] <= SMALLEST_CELL:
                finished_bound = max(finished_bound, float(bounds[k]))
            else:
                heapq.heappush(
                    frontier, (-float(bounds[k]), float(half[k]), side, float(centre[k].real), float(centre[k].imag))
                )
    left = -frontier[0][0] if frontier else -np.inf
    upper = max(value, left, finished_bound)
    problem = sides[int(best.reflected)] if len(sides) > 1 else sides[0]
    return SearchResult(
        mobius=best,
        value=value,
        upper_bound=upper,
        certified=bool(upper == value),
        nodes=nodes,
        seconds=time.perf_counter() - started,
        matches=problem.matches(Mobius(best.z, best.theta)),
        cancelled=cancelled,
    )


def cell_bounds(problem: Matching, centre: Complexes, half: Floats) -> Floats:
    """Return, for each square cell of z, (C,), a number that Q does not exceed at any z in it and any theta."""
    # the circumscribed disc's radius, rounded up
    arcs = enclosing_arcs(problem, centre, half * (np.sqrt(2) * (1 + 2.0**-50)))
    row, pair, middle, half_width = arcs
    return stab(row, problem.point[pair], middle, half_width, problem.weight[pair], len(centre), len(problem.source))[0]


def best_rotations(problem: Matching, z: Complexes) -> tuple[Floats, Floats]:
    """Return U(z) = max over theta of Q, and such a theta in radians, for each z, (C,); to rounding error."""
    row, pair, middle, half_width = exact_arcs(problem, z)
    return stab(row, problem.point[pair], middle, half_width, problem.weight[pair], len(z), len(problem.source))


def _improved(problem: Matching, z: Complexes, reflected: bool) -> tuple[Mobius, float]:
    """Return the best transformation with z among the given, and its value as the definition has it."""
    values, rotations = best_rotations(problem, z)
    k = int(np.argmax(values))
    plain = Mobius(complex(z[k]), float(rotations[k]))
    return _mirrored(plain, reflected), problem.value(plain)


def _mirrored(plain: Mobius, reflected: bool) -> Mobius:
    """Return the transformation of the source itself, given the one of the (perhaps conjugated) source."""
    return Mobius(plain.z, plain.theta, reflected)


def _better(best: Mobius, value: float, other: Mobius, other_value: float) -> tuple[Mobius, float]:
    """Return whichever transformation has the larger value; the first on a tie."""
    return (other, other_value) if other_value > value else (best, value)


def _children(batch: list[tuple[float, float, int, float, float]], z_max: float) -> tuple[Complexes, Floats]:
    """Return centres and half sides of the quarters of the cells that reach into |z| <= z_max."""
    half = np.repeat([cell[1] / 2 for cell in batch], 4)
    parent = np.repeat([complex(cell[3], cell[4]) for cell in batch], 4)
    centre = parent + half * np.tile([-1 - 1j, 1 - 1j, -1 + 1j, 1 + 1j], len(batch))
    nearest = np.hypot(np.maximum(np.abs(centre.real) - half, 0), np.maximum(np.abs(centre.imag) - half, 0))
    reaching = nearest <= z_max * (1 + 2.0**-50)
    return centre[reaching], half[reaching]
