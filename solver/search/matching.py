"""The objective: how much of the source a Möbius transformation brings into match discs of the target.

Q(z, theta) = sum_j max_k w_jk [f(m_j | z, theta) in disc(c_k, e_k)], Le, Chin and Suter (2016), eq. 3, with weights.
The paper's objective is w = 1 with Euclidean discs of one radius; hyperbolic discs keep the optimum inside the disc.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..mobius import Mobius, hyperbolic_disc
from ..surface.mesh import Complexes, Floats, Integers


@dataclass(frozen=True, eq=False)
class Matching:
    """Source points, and the match discs that each of them may land in.

    Attributes
    ----------
    source : (N1,) complex128
        Points of the closed unit disc.
    point, target : (P,) int
        Source point and target point of each compatible pair, sorted by source point.
    centre : (P,) complex128
        Euclidean centre of the pair's match disc.
    radius : (P,) float64
        Its Euclidean radius, > 0.
    weight : (P,) float64
        In (0, 1], a multiple of `unit`.
    unit : float
        1 if all weights are 1, else a power of 2 so small that a weight is rounded by 2^-20 or less for up to 2,047
        points, and so large that N1 / unit < 2^31: every sum of weights is exact, in any order, in 32 bits too.
    """

    source: Complexes
    point: Integers
    target: Integers
    centre: Complexes
    radius: Floats
    weight: Floats
    unit: float = 1.0

    @property
    def limit(self) -> float:
        """The value that no transformation can exceed: every source point at its largest weight."""
        most = np.zeros(len(self.source))
        np.maximum.at(most, self.point, self.weight)
        return float(most.sum())

    def reflected(self) -> Matching:
        """Return the matching of the conjugated source."""
        return replace(self, source=np.conj(self.source))

    def hits(self, mobius: Mobius) -> Integers:
        """Return the pairs, as indices into `point` and `target`, whose disc the transformed source point lies in."""
        image = mobius(self.source)
        return np.flatnonzero(np.abs(image[self.point] - self.centre) <= self.radius)

    def value(self, mobius: Mobius) -> float:
        """Return Q for one transformation, straight from its definition."""
        hits = self.hits(mobius)
        best = np.zeros(len(self.source))
        np.maximum.at(best, self.point[hits], self.weight[hits])
        return float(best.sum())

    def matches(self, mobius: Mobius) -> Integers:
        """Return one (source point, target point) row per matched source point: the heaviest pair, then the nearest."""
        hits = self.hits(mobius)
        distance = np.abs(mobius(self.source)[self.point[hits]] - self.centre[hits]) / self.radius[hits]
        order = hits[np.lexsort([distance, -self.weight[hits], self.point[hits]])]
        _, first = np.unique(self.point[order], return_index=True)
        return np.stack([self.point[order[first]], self.target[order[first]]], axis=1)


def matching(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
) -> Matching:
    """Check the input of a search and list its compatible pairs; see `search` for the parameters.

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, points outside the closed unit disc, radii out of range, weights
        outside [0, 1], an unknown metric.
    """
    m = _disc_points(source, "source")
    b = _disc_points(target, "target")
    e = np.asarray(radius, dtype=np.float64)
    if e.ndim > 1 or (e.ndim == 1 and len(e) != len(b)):
        raise ValueError(f"radius must be one number or one per target point ({len(b)}), not of shape {e.shape}")
    e = np.broadcast_to(e, b.shape)
    if not (np.isfinite(e).all() and (e > 0).all()):
        raise ValueError("every radius must be a finite number above 0")
    if metric == "hyperbolic":
        if (e >= 1).any():
            raise ValueError("a hyperbolic radius is |x - b| / |1 - conj(b) x| and must be below 1")
        if (np.abs(b) >= 1).any():
            raise ValueError(
                "hyperbolic match discs need target points inside the unit circle: leave out those on the boundary"
            )
        centre, e = hyperbolic_disc(b, e)
    elif metric == "euclidean":
        centre = b
    else:
        raise ValueError(f"unknown metric '{metric}': use 'hyperbolic' or 'euclidean'")
    if weights is None:
        j, k = (x.ravel() for x in np.indices((len(m), len(b))))
        w, unit = np.ones(len(j)), 1.0
    else:
        table = np.asarray(weights, dtype=np.float64)
        if table.shape != (len(m), len(b)):
            raise ValueError(f"weights must be of shape {(len(m), len(b))}, not {table.shape}")
        if not (np.isfinite(table).all() and (table >= 0).all() and (table <= 1).all()):
            raise ValueError("every weight must lie in [0, 1]")
        unit = 1.0 if np.isin(table, (0, 1)).all() else 2.0 ** (len(m).bit_length() - 31)
        table = np.round(table / unit) * unit
        j, k = np.nonzero(table)
        w = table[j, k]
    return Matching(m, j.astype(np.intp), k.astype(np.intp), centre[k], e[k], w, unit)


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
    """What is searched: points of both discs, the radii of the match discs and the weights of the pairs."""

    source: Complexes
    target: Complexes
    radius: Floats
    weights: Floats
