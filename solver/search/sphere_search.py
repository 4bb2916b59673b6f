"""The best Möbius transformation of the sphere: rotations proved first, then all six degrees with a bound on |h|.

The group of the sphere is not compact either, and centring by area takes out nearly all of what is not a rotation. So
the rotations, three degrees of which one is stabbed exactly, are searched to the end (`sphere_rotations`); from the
best of them a pattern search climbs in all six; then branch and bound goes over all transformations with |h| <= h_max,
halving boxes of matrices (`box_bounds`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from ..mobius import SphereMobius
from ..stages import SearchProgress
from ..surface.mesh import Booleans, Floats
from .box_bounds import place_of, transformation
from .branch_and_bound import require_ends
from .frontier import FRONTIER, SMALLEST_CELL, Search
from .kernels.box_kernels import box_kernels_for
from .kernels.boxes import BOUND, COLUMNS, LARGEST, MIDDLE, SIDES, coefficients, points, whole_group
from .outcome import SphereSearchResult
from .sphere_matching import MOST_H, SphereMatching, sphere_matching
from .sphere_rotations import Rotations, never
from .sphere_seeds import seeds
from .watch import watched

FIRST_STEP, LAST_STEP = 0.1, 1e-4
"""Of the climb from the best rotation: coefficients of matrices, half an angle or h."""

AT_ONCE = 1024
"""Open boxes taken on in one round of all transformations."""

LOOKED_AT = 128
"""Boxes of a round in whose middles a better transformation is looked for: some tenth of the round's time."""

CLIMBED = 1 / 8
"""Transformations looked at in climbs that begin below the best value, over boxes bounded."""

WAYS = 24
"""Directions of a climb beside those of the coefficients: steps of one alone get stuck on ridges."""

HOPELESS = 0.5
"""Share of the value by which the bound exceeds it after an eighth of the cells where the rest would not prove much: on
28 pairs of teeth, limbs, bones and brain layers three more doublings left a fifth of a gap (the median), and of the
four that were above a half, .27 to .93 of the value: hands, teeth of two genera, white and inflated matter."""

SHARE = 0.7
"""Of the present gap: what bounds are brought down to in one round, so that the gap falls everywhere alike."""


def sphere_search(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    h_max: float = 0.2,
    reflect: bool = False,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    gap: float = 0.0,
    most_nodes: int | None = None,
) -> SphereSearchResult:
    """Find the Möbius transformation that brings the greatest weight of source points into match caps of the target.

    Parameters
    ----------
    source, target : (N1, 3), (N2, 3) float
        Points of the unit sphere.
    radius : float or (N2,) float
        Radius of the match caps, as a chord |x - b|.
    weights : (N1, N2) float, optional
        In [0, 1]; 0 means incompatible. Rounded to multiples of 2^-20 or less (`Matching.unit`). Default: all 1.
    h_max : float
        Bound on |h|, in [0, 0.9]; 0: rotations alone.
    reflect : bool
        Search the transformations of the reflected source as well.
    time_limit, threads, progress
        As for `search`.
    gap : float
        The search ends as soon as `upper_bound` is proved to exceed `value` by at most this share of it. The rotations
        are searched to their end all the same.
    most_nodes : int, optional
        Cells whose bound is computed before the search of all transformations ends: unlike a time limit, the same on
        every machine. An eighth of them where the bound still exceeds the value by more than half of it (`HOPELESS`).

    Returns
    -------
    SphereSearchResult
        Valid at whatever moment the search ended.

    Raises
    ------
    ValueError
        Wrong shapes or values out of range; the text names which.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> source = rng.normal(size=(12, 3))
    >>> source /= np.linalg.norm(source, axis=1, keepdims=True)
    >>> found = sphere_search(source, SphereMobius(rotation=(1, 2, 3, 4))(source), 0.01, h_max=0)
    >>> found.value, found.certified
    (12.0, True)
    """
    if not 0 <= h_max <= MOST_H:
        raise ValueError(f"h_max must lie between 0 and {MOST_H}, not {h_max}")
    require_ends(time_limit, threads, gap)
    started = time.perf_counter()

    def work() -> None:
        state.begin(sphere_matching(source, target, radius, weights=weights, check=state.check), reflect)
        state.run(np.inf if time_limit is None else started + time_limit, threads or os.cpu_count() or 1)

    size = np.shape(source)
    state = _SphereSearch(float(h_max), float(size[0] if size else 0), gap, most_nodes)
    deadline = None if time_limit is None else started + time_limit
    tell = None if progress is None else lambda: progress(state.progress(time.perf_counter() - started))
    cancelled = watched(work, state.halt, deadline, tell)
    return state.outcome(time.perf_counter() - started, cancelled)


class _SphereSearch(Search):
    """The state of one search on the sphere."""

    identity = SphereMobius()
    bound_at, half_at = BOUND, LARGEST
    at_once = AT_ONCE

    def __init__(self, h_max: float, limit: float, gap: float, most_nodes: int | None) -> None:
        super().__init__(h_max, limit, self._is_enough)
        self.gap, self.most_nodes = gap, np.inf if most_nodes is None else most_nodes
        self.turns = Rotations(0.0, limit, never)
        self.turns.halt = self.halt
        self.rotation, self.rotation_value, self.rotation_bound = self.identity, 0.0, limit
        self.climbed = 0
        ways = np.random.default_rng(0).normal(size=(WAYS, 6))
        self.ways = np.concatenate([np.eye(6), -np.eye(6), ways / np.linalg.norm(ways, axis=1, keepdims=True)])

    def begin(self, plain: SphereMatching, reflect: bool) -> None:
        """Set up what the search needs."""
        self.unlooked = plain.limit
        try:
            self.turns.begin(plain, reflect)
        finally:
            self._take_over()

    def run(self, deadline: float, threads: int) -> None:
        """Search the rotations to their end, climb from the best, and search all."""
        try:
            self.turns.run(deadline, threads)
        finally:
            self._take_over()
        if self.z_max == 0 or self.out_of_time:
            return
        self.kernels = [box_kernels_for(side, self.z_max, SMALLEST_CELL, self.halt) for side in self.sides]
        self.frontier = [whole_group(x.limit, y.width) for x, y in zip(self.sides, self.kernels, strict=True)]
        self.unlooked = -np.inf
        self._climb(self.best_side, place_of(self._plain(self.best)), self.value, FIRST_STEP)
        for side, problem in enumerate(self.sides):
            for some in seeds(problem, self.z_max):
                if self.value < problem.limit:
                    self._look(side, points(some), FIRST_STEP / 8)
        super().run(deadline, threads)

    def _take_over(self) -> None:
        """Take what the search of rotations has found and proved, wherever it was called off."""
        turns = self.turns
        self.sides, self.kernels = turns.sides, turns.kernels
        self.best, self.best_side = turns.best, turns.best_side
        self.value, self.matches = turns.value, turns.matches
        self.rotation, self.rotation_value, self.rotation_bound = turns.best, turns.value, turns.upper_bound
        self.nodes, self.out_of_time = turns.nodes, turns.out_of_time
        if self.z_max == 0:
            self.finished_bound, self.unlooked, self.ended = turns.upper_bound, -np.inf, turns.ended
        before = self.unlooked if self.z_max else -np.inf  # of all, nothing is proved yet
        self.trace = [replace(x, upper_bound=max(x.upper_bound, before)) for x in turns.trace]

    def progress(self, seconds: float) -> SearchProgress:
        """Return what was proved when the last round ended."""
        if self.frontier or self.z_max == 0:
            return super().progress(seconds) if self.frontier else self.turns.progress(seconds)
        value, _, nodes = self.turns.proved
        return SearchProgress(value, self.unlooked, nodes, seconds)

    def _is_enough(self, value: float, bound: float, nodes: int) -> bool:
        if self.gap > 0 and bound <= value * (1 + self.gap):
            return True
        return nodes >= self.most_nodes / (8 if bound > value * (1 + HOPELESS) else 1)

    @property
    def _enough(self) -> float:
        """What bounds need not fall below."""
        return self.value * (1 + self.gap)

    def _settled(self, cells: Floats) -> Booleans:
        return super()._settled(cells) | (cells[:, BOUND] <= self._enough)

    def _limits(self) -> tuple[float, ...]:
        """Return what bounds are held against, and what is low enough for this round."""
        if sum(map(len, self.frontier)) > FRONTIER:
            return self.value, self._enough
        return self.value, max(self._enough, self.value + SHARE * (self.upper_bound - self.value))

    def outcome(self, seconds: float, cancelled: bool) -> SphereSearchResult:
        """Return the outcome, wherever the search has been called off."""
        plain = self.result(seconds, cancelled)
        return SphereSearchResult(
            **vars(plain),
            h_max=self.z_max,
            rotation=self.rotation,
            rotation_value=self.rotation_value,
            rotation_bound=self.rotation_bound,
        )

    def _plain(self, best: SphereMobius) -> SphereMobius:
        return SphereMobius(best.h, best.rotation)

    def _improve(self, side: int, left: Floats) -> None:
        """Look for a better transformation in the middle of the most promising boxes, and around the best of them."""
        chosen = left[np.argsort(-left[:, BOUND], kind="stable")[:LOOKED_AT]]
        if len(chosen) == 0:
            return
        middles = chosen[:, :COLUMNS].copy()
        middles[:, SIDES] = 0
        low = 2 * self.value - self.upper_bound  # as far below as the bound is above
        self._look(side, middles, float(chosen[:, LARGEST].max()), low if self.climbed < CLIMBED * self.nodes else None)

    def _look(self, side: int, places: Floats, step: float, low: float | None = None) -> None:
        """Climb from the best of some boxes without extent, if it is worth more than `low`, or than the best so far."""
        self.check()
        low = self.value if low is None else low
        values = self.kernels[side].bounds(places, low)
        k = int(np.argmax(values))
        if values[k] > low:
            self._climb(side, places[k], float(values[k]), step)

    def _climb(self, side: int, box: Floats, value: float, step: float) -> None:
        """Climb from a box's middle by a pattern search: the value is a step function, so there is no slope."""
        here = box.copy()
        here[SIDES] = 0
        while step > LAST_STEP:
            self.check()
            around = np.repeat(here[None], len(self.ways), axis=0)
            around[:, MIDDLE] += step * self.ways
            around = points(coefficients(around))
            values = self.kernels[side].bounds(around, value)
            self.climbed += len(around)
            k = int(np.argmax(values))
            if values[k] > value:
                here, value = around[k], float(values[k])
            else:
                step /= 2
        if value > self.value:
            self._offer(side, here)

    def _offer(self, side: int, found: Floats) -> None:
        """Take a transformation if it is better, and within the bound on |h| to its last digit."""
        mobius = transformation(found)
        value, matches = self.sides[side].evaluated(mobius, self.check)
        if value > self.value and h_within(mobius.h, self.z_max):
            self.value, self.matches, self.best_side = value, matches, side
            self.best = SphereMobius(mobius.h, mobius.rotation, side == 1)


def h_within(h: tuple[float, float, float], h_max: float) -> bool:
    """Return whether |h| <= h_max, exactly."""
    return sum(Fraction(x) ** 2 for x in h) <= Fraction(h_max) ** 2
