"""The best Möbius transformation of the sphere: rotations proved first, then all six degrees with a bound on |h|.

The group of the sphere is not compact either, and centring by area takes out nearly all of what is not a rotation. So
the rotations, three degrees of which one is stabbed exactly, are searched to the end; from the best of them a pattern
search climbs in all six; then branch and bound goes over all transformations with |h| <= h_max, from there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from ..mobius import SphereMobius
from ..stages import SearchProgress
from ..surface.mesh import Floats
from .branch_and_bound import CENTRES, NEAR, SMALLEST_CELL, Search
from .kernels import MOST_POINTS
from .kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y
from .kernels.sphere_kernels import sphere_kernels_for
from .kernels.sphere_nodes import BALL, HX, HZ, whole_sphere
from .outcome import SearchResult
from .sphere_bounds import transformation
from .sphere_matching import MOST_H, SphereMatching, sphere_matching
from .watch import watched

_IDENTITY = SphereMobius()

FIRST_STEP, LAST_STEP = 0.1, 1e-4
"""Of the climb from the best rotation, in radians and in h."""


@dataclass(frozen=True, eq=False)
class SphereSearchResult(SearchResult):
    """The outcome of a search on the sphere, complete or not.

    `upper_bound` and `certified` are about all transformations with |h| <= h_max.

    Attributes
    ----------
    mobius : SphereMobius
    h_max : float
    rotation : SphereMobius
        The best rotation found, reflected or not.
    rotation_value : float
        Its Q.
    rotation_bound : float
        No rotation has a larger Q.
    """

    mobius: SphereMobius  # pyright: ignore[reportIncompatibleVariableOverride]
    h_max: float = 0.0
    rotation: SphereMobius = _IDENTITY
    rotation_value: float = 0.0
    rotation_bound: float = np.inf

    @property
    def rotations_certified(self) -> bool:
        """Whether it is proved that no rotation has a larger Q than the transformation found."""
        return self.rotation_bound <= self.value

    def as_reflected(self) -> SphereSearchResult:
        """Return the result of a search on the reflected source as one on the source itself."""
        mobius, rotation = (SphereMobius(x.h, x.rotation, True) for x in (self.mobius, self.rotation))
        return replace(self, mobius=mobius, rotation=rotation)

    @property
    def proved(self) -> str:
        """What is proved, in words."""
        if self.certified and self.h_max > 0:
            return f"no Möbius transformation with |h| <= {self.h_max:g} matches more"
        if self.h_max > 0 and self.relative_gap < 0.5:
            more = f"matches more than {100 * self.relative_gap:.1f} % more"
            return f"no Möbius transformation with |h| <= {self.h_max:g} {more}"
        if self.rotations_certified:
            return "no rotation matches more"
        return "nothing: time ran out"


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
        every machine.

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
    if time_limit is not None and not time_limit >= 0:
        raise ValueError(f"time_limit must be a number of seconds, not {time_limit}")
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be at least 1, not {threads}")
    if not gap >= 0:
        raise ValueError(f"gap must be a share of the value, 0 or more, not {gap}")
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


def _never(value: float, bound: float, nodes: int) -> bool:
    del value, bound, nodes
    return False


class _SphereSearch(Search):
    """The state of one search on the sphere."""

    identity = SphereMobius()

    def __init__(self, h_max: float, limit: float, gap: float, most_nodes: int | None) -> None:
        super().__init__(h_max, limit, _never)
        self.gap, self.most_nodes = gap, np.inf if most_nodes is None else most_nodes
        self.climbs_h = False
        self.hold = (0, whole_sphere(limit, 0)[0], 0.0)  # side, cell and angle of the best
        self.rotation, self.rotation_value, self.rotation_bound = SphereMobius(), 0.0, limit

    def begin(self, plain: SphereMatching, reflect: bool) -> None:
        """Set up what the search needs."""
        self.sides = [plain, plain.reflected()] if reflect else [plain]
        self.unlooked = self.rotation_bound = plain.limit
        self.value, self.matches = plain.evaluated(self.best, self.check)
        self.kernels = [sphere_kernels_for(plain, self.z_max, SMALLEST_CELL, MOST_POINTS, self.halt)]
        if reflect:
            self.kernels.append(self.kernels[0].reflected())
        self.frontier = [whole_sphere(problem.limit, 0) for problem in self.sides]

    def run(self, deadline: float, threads: int) -> None:
        """Search the rotations to their end, climb from the best, and search all."""
        if self.z_max == 0:
            self.unlooked = -np.inf
        try:
            super().run(deadline, threads)
        finally:  # valid wherever it was called off
            tops = [open_[:, BOUND].max(initial=-np.inf) for open_ in self.frontier]
            self.rotation, self.rotation_value = self.best, self.value
            self.rotation_bound = float(max(self.value, self.finished_bound, *tops))
        if self.z_max == 0 or self.out_of_time:
            return
        self.ended = False
        side, cell, phi = self.hold
        self.climbs_h = True
        self._climb(side, cell, phi, self.value, FIRST_STEP)
        self.until = lambda value, bound, nodes: (
            nodes >= self.most_nodes or (self.gap > 0 and bound <= value * (1 + self.gap))
        )
        self.frontier = [whole_sphere(problem.limit, self.z_max) for problem in self.sides]
        self.finished_bound, self.unlooked = -np.inf, -np.inf
        super().run(deadline, threads)

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
        """Look for a better transformation in the middle of the most promising cells, then around the best of them."""
        inside = left[(left[:, HX : HZ + 1] ** 2).sum(axis=1) <= self.z_max**2]
        inside = inside[np.argsort(-inside[:, BOUND], kind="stable")[:CENTRES]]
        if len(inside) == 0:
            return
        values, angles = self.kernels[side].rotations(inside, self.value, inside[:, [FROM, WIDTH]])
        k = int(np.argmax(values))
        if values[k] > self.value:
            cell = inside[k]
            self._climb(side, cell, float(angles[k]), float(values[k]), float(max(cell[HALF], cell[BALL])))

    def _climb(self, side: int, cell: Floats, phi: float, value: float, step: float) -> None:
        """Climb from a cell's middle by a pattern search: the value is a step function, so there is no slope."""
        here = cell.copy()
        here[[HALF, BALL]] = 0
        ring = np.exp(2j * np.pi * np.arange(8) / 8)
        ways = np.zeros((14 if self.climbs_h else 8, 5))
        ways[:8, 0], ways[:8, 1] = ring.real, ring.imag
        ways[8:, 2:] = np.concatenate([np.eye(3), -np.eye(3)]) if self.climbs_h else 0
        while step > LAST_STEP:
            self.check()
            around = np.repeat(here[None], len(ways), axis=0)
            scale = np.sqrt(1 + here[X] ** 2 + here[Y] ** 2)
            around[:, [X, Y]] += step * scale * ways[:, :2]
            around[:, HX : HZ + 1] += step * ways[:, 2:]
            around = around[(around[:, HX : HZ + 1] ** 2).sum(axis=1) <= self.z_max**2]
            near = np.tile([phi / (2 * np.pi) - 0.5 * NEAR, NEAR], (len(around), 1))
            values, angles = self.kernels[side].rotations(around, value, near)
            k = int(np.argmax(values)) if len(values) else -1
            if k >= 0 and values[k] > value:
                here, value, phi = around[k], float(values[k]), float(angles[k])
            else:
                step /= 2
        found = transformation(here, phi)
        before = self.value
        self._offer(side, found)
        if self.value > before:
            self.hold = side, here, phi

    def _offer(self, side: int, found: SphereMobius) -> None:
        """Take a transformation if it is better, and within the bound on |h| to its last digit."""
        value, matches = self.sides[side].evaluated(found, self.check)
        if value > self.value and h_within(found.h, self.z_max):
            self.value, self.matches, self.best_side = value, matches, side
            self.best = SphereMobius(found.h, found.rotation, side == 1)


def h_within(h: tuple[float, float, float], h_max: float) -> bool:
    """Return whether |h| <= h_max, exactly."""
    return sum(Fraction(x) ** 2 for x in h) <= Fraction(h_max) ** 2
