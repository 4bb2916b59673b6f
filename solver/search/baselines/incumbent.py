"""The best transformation that a baseline has tried so far, and whether it is to try on."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ...mobius import Mobius
from ...stages import SearchProgress
from ...surface.mesh import Complexes, Floats
from ..matching import Matching, matching
from ..outcome import SearchResult


@dataclass
class Incumbent:
    """The problem as `search` is given it, and what has been reached on it.

    Attributes
    ----------
    problem : Matching
    target : (N2,) complex128
        Points of the closed unit disc: the match discs' centres in the metric.
    metric : str
        "hyperbolic" or "euclidean".
    z_max : float
        Transformations with a larger |z| are not taken.
    sides : tuple of bool
        The orientations to try: not reflected and, where asked for, reflected.
    mobius, value
        The best transformation offered, and its Q; -1 before the first.
    nodes : int
        Transformations tried, as the method counts them.
    """

    problem: Matching
    target: Complexes
    metric: str
    z_max: float
    sides: tuple[bool, ...]
    time_limit: float | None
    progress: Callable[[SearchProgress], bool | None] | None
    mobius: Mobius = field(default_factory=Mobius)
    value: float = -1.0
    nodes: int = 0
    cancelled: bool = False
    _started: float = field(default_factory=time.perf_counter)
    _reported: float = field(default_factory=time.perf_counter)

    def source(self, reflected: bool) -> Complexes:
        """Return the source points as the plain transformations of this side see them."""
        return np.conj(self.problem.source) if reflected else self.problem.source

    @cached_property
    def weights(self) -> Floats:
        """The weight of each pair, (N1, N2); 0 where incompatible."""
        table = np.zeros((len(self.problem.source), len(self.target)))
        table[self.problem.point, self.problem.target] = self.problem.weight
        return table

    def offer(self, plain: Mobius, reflected: bool) -> None:
        """Take a transformation of `source(reflected)` if it is better."""
        mobius = Mobius(plain.z, plain.theta, reflected)
        if abs(mobius.z) <= self.z_max and (value := self.problem.value(mobius)) > self.value:
            self.mobius, self.value = mobius, value

    def goes_on(self) -> bool:
        """Report progress a few times a second; return False once the time is over or the caller has had enough."""
        now = time.perf_counter()
        if self.progress is not None and now - self._reported > 0.1:
            self._reported = now
            state = SearchProgress(max(self.value, 0.0), self.problem.limit, self.nodes, now - self._started)
            self.cancelled = self.cancelled or self.progress(state) is False
        return not self.cancelled and (self.time_limit is None or now - self._started <= self.time_limit)

    def result(self) -> SearchResult:
        """Return the outcome; the identity where nothing was offered."""
        if self.value < 0:
            self.offer(Mobius(), False)
        return SearchResult(
            mobius=self.mobius,
            value=self.value,
            upper_bound=self.problem.limit,
            certified=False,
            nodes=self.nodes,
            seconds=time.perf_counter() - self._started,
            matches=self.problem.matches(self.mobius),
            cancelled=self.cancelled,
            kernels="numpy",
            counted=(self.problem, self.mobius),
        )


def incumbent(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str,
    weights: npt.ArrayLike | None,
    z_max: float,
    reflect: bool,
    time_limit: float | None,
    threads: int | None,
    progress: Callable[[SearchProgress], bool | None] | None,
) -> Incumbent:
    """Check the arguments, which are those of `search`, and start the clock.

    Raises
    ------
    ValueError
        As `search` does.
    """
    if not 0 < z_max < 1:
        raise ValueError(f"z_max must lie between 0 and 1, not {z_max}")
    if time_limit is not None and not time_limit >= 0:
        raise ValueError(f"time_limit must be a number of seconds, not {time_limit}")
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be at least 1, not {threads}")
    problem = matching(source, target, radius, metric=metric, weights=weights)
    points = np.asarray(target, np.complex128)
    points = points / np.maximum(np.abs(points), 1)
    return Incumbent(problem, points, metric, z_max, (False, True) if reflect else (False,), time_limit, progress)
