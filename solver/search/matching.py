"""The objective: how much of the source a Möbius transformation brings into match discs of the target.

Q(z, theta) = sum_j max_k w_jk [f(m_j | z, theta) in disc(c_k, e_k)], Le, Chin and Suter (2016), eq. 3, with weights.
The paper's objective is w = 1 with Euclidean discs of one radius; hyperbolic discs keep the optimum inside the disc.

A pair counts only if it is matched in exact arithmetic, by the points and radii as they were given. Floats decide that
where they can: an image is computed to less than 2^-46 (1 + 1 / |1 - conj(z) m|), and centre and radius of a disc are
off by less than 2^-48 (`hyperbolic_disc`), so that a distance which is off the radius by more than `GUARD` times that
is on the same side of it exactly. Of the others, next to the rim of their disc, `rim` decides in integers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..mobius import hyperbolic_disc, one_less_square
from ..surface.mesh import Complexes, Floats, Integers, Places
from .pairs import MOST_PAIRS, PAIRS_AT_ONCE, Rows, nothing, rows_of, too_many
from .rim import surely_within

GUARD = 2.0**-45
"""Over 1 + 1 / |1 - conj(z) m|: how near to the rim of a disc floats do not decide."""

MOST_EXACT = 4096
"""Pairs on the rim that one count decides in integers, some 10 us each; beyond, they do not count as matched."""


@dataclass(frozen=True, eq=False)
class Discs:
    """The match discs as they were given: every x with |x - centre| <= radius |1 - conj(centre) x|, or <= radius.

    Attributes
    ----------
    centre : (N2,) complex128
    radius : (N2,) float64
    hyperbolic : bool
        The first of the two inequalities.
    """

    centre: Complexes
    radius: Floats
    hyperbolic: bool


@dataclass(frozen=True, eq=False)
class Matching:
    """Source points, and the match discs that each of them may land in.

    Attributes
    ----------
    source : (N1,) complex128
        Points of the closed unit disc.
    centres : (N2,) complex128
        Euclidean centre of each target point's match disc.
    radii : (N2,) float64
        Its Euclidean radius, > 0.
    rows : Rows or None
        The compatible pairs; None: all, with weight 1. 8 bytes per pair are all that is kept of them.
    unit : float
        1 if all weights are 1, else a power of 2 so small that a weight is rounded by 2^-20 or less for up to 2,047
        points, and so large that N1 / unit < 2^31: every sum of weights is exact, in any order, in 32 bits too.
    given : Discs or None
        What the discs were computed from; None: they are exact as they stand.
    """

    source: Complexes
    centres: Complexes
    radii: Floats
    rows: Rows | None = None
    unit: float = 1.0
    given: Discs | None = None

    @property
    def count(self) -> int:
        """Compatible pairs."""
        return len(self.source) * len(self.centres) if self.rows is None else len(self.rows.target)

    @cached_property
    def starts(self) -> npt.NDArray[np.int64]:
        """Where the pairs of each source point begin, (N1 + 1,)."""
        return np.arange(len(self.source) + 1) * len(self.centres) if self.rows is None else self.rows.start

    @cached_property
    def limit(self) -> float:
        """The value that no transformation can exceed: every source point at its largest weight."""
        filled = np.flatnonzero(np.diff(self.starts))
        if self.rows is None or self.rows.units is None:
            return float(len(filled))
        most = np.maximum.reduceat(self.rows.units, self.starts[filled]) if len(filled) else np.zeros(0)
        return float(most.sum(dtype=np.float64)) * self.unit

    # the pairs one by one, 48 bytes each: for what is small
    @cached_property
    def point(self) -> Integers:
        """Source point of each pair, (P,), ascending."""
        return np.repeat(np.arange(len(self.source)), np.diff(self.starts))

    @cached_property
    def target(self) -> Integers:
        """Target point of each pair, (P,)."""
        return self.targets_of(0, len(self.source))

    @cached_property
    def centre(self) -> Complexes:
        """Euclidean centre of each pair's match disc, (P,)."""
        return self.centres[self.target]

    @cached_property
    def radius(self) -> Floats:
        """Its Euclidean radius, (P,)."""
        return self.radii[self.target]

    @cached_property
    def weight(self) -> Floats:
        """Weight of each pair, (P,), in (0, 1]: multiples of `unit`."""
        return self.weights_of(np.arange(self.count))

    def targets_of(self, first: int, last: int) -> Integers:
        """Return the target points of the pairs of source points first to last - 1."""
        if self.rows is None:
            return np.tile(np.arange(len(self.centres)), last - first)
        return self.rows.target[self.starts[first] : self.starts[last]].astype(np.intp)

    def weights_of(self, pairs: Integers) -> Floats:
        """Return the weights of some pairs."""
        if self.rows is None or self.rows.units is None:
            return np.ones(len(pairs))
        return self.rows.units[pairs] * self.unit

    def reflected(self) -> Matching:
        """Return the matching of the conjugated source."""
        return replace(self, source=self._conjugated())

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Cut the source points into ranges (first, last + 1) of `PAIRS_AT_ONCE` pairs or one point each."""
        first, starts = 0, self.starts
        while first < len(self.source):
            reach = int(np.searchsorted(starts, starts[first] + PAIRS_AT_ONCE, side="right")) - 1
            last = min(max(reach, first + 1), len(self.source))
            yield first, last
            first = last

    def part(self, first: int, last: int) -> Matching:
        """Return the matching of source points first to last - 1 alone."""
        if (first, last) == (0, len(self.source)):
            return self
        rows = self.rows
        if rows is not None:
            some = slice(rows.start[first], rows.start[last])
            units = None if rows.units is None else rows.units[some]
            rows = Rows(rows.start[first : last + 1] - rows.start[first], rows.target[some], units)
        return replace(self, source=self.source[first:last], rows=rows)

    def _conjugated(self) -> Any:
        """Return the source reflected."""
        return np.conj(self.source)

    @staticmethod
    def _sizes(differences: Any) -> Floats:
        """Return how long differences of points are."""
        return np.abs(differences)

    def _guard(self, mobius: Any) -> Floats:
        """Return how near to the rim of a disc floats do not decide, for the image of each source point, (N1,)."""
        z = np.conj(mobius.z) if mobius.reflected else mobius.z
        # the floor keeps a cancelled difference from looking exact
        return GUARD * (1 + 1 / np.maximum(np.abs(1 - np.conj(z) * self.source) - 2.0**-50, 2.0**-50))

    def _hits(self, mobius: Any, check: Callable[[], None]) -> Iterator[tuple[Integers, Integers, Integers, Floats]]:
        """Yield pairs whose disc the transformed source point lies in: their numbers, points, targets and distances."""
        image, spared = mobius(self.source), MOST_EXACT
        guard = self._guard(mobius)
        farthest = self.radii + guard.max()
        for first, last in self.blocks():
            check()
            pair, point, target, distance = self._apart(first, last, image, farthest)
            beyond = distance - self.radii[target]
            sure = beyond < -guard[point]
            close = np.flatnonzero((beyond <= guard[point]) & ~sure)
            if len(close):
                some, spared = close[:spared], max(spared - len(close), 0)
                sure[some] = self._surely(mobius, point[some], target[some])
            yield pair[sure], point[sure], target[sure], distance[sure]

    def _apart(
        self, first: int, last: int, image: Any, farthest: Floats
    ) -> tuple[Integers, Integers, Integers, Floats]:
        """Return the pairs of source points first to last - 1 that are no farther apart, and their distances."""
        if self.rows is None:
            table = self._sizes(image[first:last, None] - self.centres)
            point, target = np.nonzero(table <= farthest)
            return (point + first) * len(self.centres) + target, point + first, target, table[point, target]
        point = np.repeat(np.arange(first, last), np.diff(self.starts[first : last + 1]))
        target = self.targets_of(first, last)
        distance = self._sizes(image[point] - self.centres[target])
        pair = np.flatnonzero(distance <= farthest[target])
        return pair + self.starts[first], point[pair], target[pair], distance[pair]

    def _surely(self, mobius: Any, point: Integers, target: Integers) -> npt.NDArray[np.bool_]:
        discs = self.given or Discs(self.centres, self.radii, False)
        return surely_within(
            mobius, self.source[point], discs.centre[target], discs.radius[target], hyperbolic=discs.hyperbolic
        )

    def hits(self, mobius: Any) -> Integers:
        """Return the pairs, as indices into `point` and `target`, whose disc the transformed source point lies in."""
        return self.within(mobius)[0]

    def within(self, mobius: Any) -> tuple[Integers, Integers, Integers]:
        """Return `hits`, and their source and target points, (h,) each."""
        parts = zip(*((pair, j, k) for pair, j, k, _ in self._hits(mobius, nothing)), strict=True)
        pair, j, k = (np.concatenate(x) for x in parts)
        return pair, j, k

    def value(self, mobius: Any) -> float:
        """Return Q for one transformation, straight from its definition, as far as it is certain."""
        return self.evaluated(mobius)[0]

    def matches(self, mobius: Any) -> Integers:
        """Return one (source point, target point) row per matched source point: the heaviest pair, then the nearest."""
        return self.evaluated(mobius)[1]

    def evaluated(self, mobius: Any, check: Callable[[], None] = nothing) -> tuple[float, Integers]:
        """Return `value` and `matches`; `check` is called every few milliseconds and may raise."""
        worth, chosen = 0.0, [np.zeros((0, 2), np.intp)]
        for pair, point, target, distance in self._hits(mobius, check):
            if len(pair) == 0:
                continue
            # next to the circle a radius may come out as 0
            weight, apart = self.weights_of(pair), distance / np.maximum(self.radii[target], np.finfo(float).tiny)
            first = np.flatnonzero(np.diff(point, prepend=-1))
            length = np.diff(np.append(first, len(point)))
            heaviest = np.maximum.reduceat(weight, first)
            apart[weight < np.repeat(heaviest, length)] = np.inf
            nearest = np.flatnonzero(apart == np.repeat(np.minimum.reduceat(apart, first), length))
            # of equals the first
            _, one = np.unique(point[nearest], return_index=True)
            chosen.append(np.stack([point[nearest[one]], target[nearest[one]]], axis=1))
            worth += float(heaviest.sum())
        return worth, np.concatenate(chosen)


def matching(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
    check: Callable[[], None] = nothing,
) -> Matching:
    """Check the input of a search and list its compatible pairs; see `search` for the parameters.

    `check` is called every few milliseconds and may raise.

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, points outside the closed unit disc, radii out of range, weights
        outside [0, 1], more than `MOST_PAIRS` pairs, an unknown metric.
    """
    m = _disc_points(source, "source")
    b = _disc_points(target, "target")
    e = np.asarray(radius, dtype=np.float64)
    if e.ndim > 1 or (e.ndim == 1 and len(e) != len(b)):
        raise ValueError(f"radius must be one number or one per target point ({len(b)}), not of shape {e.shape}")
    e = np.broadcast_to(e, b.shape)
    if not (np.isfinite(e).all() and (e > 0).all()):
        raise ValueError("every radius must be a finite number above 0")
    given = None
    if metric == "hyperbolic":
        if (e >= 1).any():
            raise ValueError("a hyperbolic radius is |x - b| / |1 - conj(b) x| and must be below 1")
        if (one_less_square(b) <= 0).any():
            raise ValueError(
                "hyperbolic match discs need target points inside the unit circle: leave out those on the boundary"
            )
        given = Discs(b, e, True)
        centre, e = hyperbolic_disc(b, e)
    elif metric == "euclidean":
        centre, e = b, np.minimum(e, 3)  # no two points of the disc are farther apart
    else:
        raise ValueError(f"unknown metric '{metric}': use 'hyperbolic' or 'euclidean'")
    rows, unit = (None, 1.0) if weights is None else rows_of(np.asarray(weights), (len(m), len(b)), check)
    found = Matching(m, centre, np.asarray(e), rows, unit, given)
    if found.count > MOST_PAIRS:
        raise too_many(found.count)
    return found


def _disc_points(points: npt.ArrayLike, role: str) -> Complexes:
    """Return points of the closed unit disc as a flat complex array, or raise ValueError."""
    x = np.asarray(points, dtype=np.complex128)
    if x.ndim != 1 or len(x) == 0:
        raise ValueError(f"the {role} must be a flat, non-empty array of complex numbers, not of shape {x.shape}")
    if not np.isfinite(x).all():
        raise ValueError(f"the {role} has points that are not finite")
    if (outside := np.abs(x) > 1 + 1e-12).any():
        raise ValueError(f"the {role} has points outside the unit disc (the first is number {np.argmax(outside)})")
    return x / np.maximum(np.abs(x), 1)


@dataclass(frozen=True, eq=False)
class Objective:
    """What is searched: points of both discs or spheres, the radii of the match discs and the weights of the pairs."""

    source: Places
    target: Places
    radius: Floats
    weights: Floats
