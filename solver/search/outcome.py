"""What a search says of itself at its end."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..mobius import Mobius, SphereMobius
from ..stages import SearchProgress
from ..surface.mesh import Integers
from .matching import Matching

TRACED = 1e-3
"""Share of itself that the gap falls by from one entry of a trace to the next: some thousand entries at most."""


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The outcome of a search, complete or not.

    Attributes
    ----------
    mobius : Mobius
        The best transformation found.
    value : float
        Its Q in exact arithmetic, by `matches`. Less only where time ran out before it was counted even once, and where
        more than 4,096 pairs at a time lie so near the rim of their discs that floats do not decide.
    upper_bound : float
        No transformation with |z| <= z_max has a larger Q.
    certified : bool
        value == upper_bound: the transformation is globally optimal, exactly.
    nodes : int
        Cells whose bound was computed.
    seconds : float
        Wall-clock time.
    matches : (p, 2) int
        A (source point, target point) pair for each matched source point.
    cancelled : bool
        Whether the progress callback ended the search.
    out_of_time : bool
        Whether the time limit ended it: another run may then end elsewhere.
    kernels : str
        What computed the bounds: "compiled" or "numpy".
    trace : tuple of SearchProgress
        Value, bound and cells against seconds since the search began: whenever the value rose or the gap fell by
        `TRACED` of itself. On the sphere the first are from the search of rotations, where the bound on all is trivial.
    """

    mobius: Mobius
    value: float
    upper_bound: float
    certified: bool
    nodes: int
    seconds: float
    matches: Integers
    cancelled: bool = False
    out_of_time: bool = False
    kernels: str = ""
    trace: tuple[SearchProgress, ...] = field(default=(), repr=False)
    counted: tuple[Matching, Mobius] | None = field(default=None, repr=False)
    """The problem, and the transformation as it takes it."""

    @property
    def gap(self) -> float:
        """How much better a transformation could still be: upper_bound - value."""
        return self.upper_bound - self.value

    @property
    def relative_gap(self) -> float:
        """The gap as a share of the value, as `search` takes it."""
        return self.gap / self.value if self.value > 0 else (np.inf if self.gap > 0 else 0.0)

    @cached_property
    def one_to_one(self) -> float:
        """The greatest weight of pairs within reach under `mobius` that share neither source nor target point.

        Computed when it is asked for: for thousands of points that takes seconds, and 8 bytes per pair of matched ones.
        """
        return 0.0 if self.counted is None else one_to_one(*self.counted)


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
    rotation: SphereMobius = field(default_factory=SphereMobius)
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


def one_to_one(problem: Matching, mobius: Mobius) -> float:
    """Return the greatest weight of pairs within reach that share neither source nor target point."""
    hits, j, k = problem.within(mobius)
    if len(hits) == 0:
        return 0.0
    rows, row = np.unique(j, return_inverse=True)
    columns, column = np.unique(k, return_inverse=True)
    table = np.zeros((len(rows), len(columns)))
    table[row, column] = problem.weights_of(hits)
    return float(table[linear_sum_assignment(table, maximize=True)].sum())
