"""The objective on the sphere: how much of the source a transformation brings into match caps of the target.

Q(f) = sum_j max_k w_jk [|f(m_j) - b_k| <= rho_k]: as in the disc (`matching`), the caps' radii as chords, so that a
pair is matched or not in exact arithmetic: f is rational in its parameters and in m as it was given, whose length is 1
to rounding only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from ..mobius import SphereMobius
from ..surface.mesh import Booleans, Floats, Integers, Places
from .matching import Matching
from .pairs import MOST_PAIRS, nothing, rows_of, too_many

LEAST_RADIUS, MOST_H = 1e-6, 0.9
"""Bounds below resp. beyond which floats would not tell matched from unmatched: caps smaller than that cannot be told
from points in the bounds, and of a transformation with larger |h| images are not computed well enough."""


@dataclass(frozen=True, eq=False)
class SphereMatching(Matching):
    """Source points, and the match caps that each of them may land in.

    Attributes
    ----------
    source : (N1, 3) float64
        Points of the unit sphere.
    centres : (N2, 3) float64
        Centre of each target point's match cap.
    radii : (N2,) float64
        Its radius as a chord, in (0, 2].
    rows, unit
        As in `Matching`.
    """

    source: Places
    centres: Places

    def _conjugated(self) -> Floats:
        return self.source * [1.0, -1.0, 1.0]

    @staticmethod
    def _sizes(differences: Any) -> Floats:
        return np.sqrt((differences**2).sum(axis=-1))

    def _guard(self, mobius: SphereMobius) -> Floats:
        h = np.array(mobius.h) * [1.0, -1.0 if mobius.reflected else 1.0, 1.0]
        # |h| < 1, but w = m - h has lost digits where it is short
        short = np.maximum(np.sqrt(((self.source - h) ** 2).sum(axis=1)), 2.0**-26)
        return 2.0**-46 * (1 + 4 / short**2)

    def _surely(self, mobius: SphereMobius, point: Integers, target: Integers) -> Booleans:
        return surely_within(mobius, self.source[point], self.centres[target], self.radii[target])


def surely_within(mobius: SphereMobius, m: Floats, b: Floats, rho: Floats) -> Booleans:
    """Return for which pairs, (n,), |f(m) - b| <= rho, exactly.

    With w = m - h and q the quaternion, |w|^2 |q|^2 (f(m) - b) = q ((1 - |h|^2) w - |w|^2 h) conj(q) - |w|^2 |q|^2 b.
    """
    h = [Fraction(x) for x in mobius.h]
    q = [Fraction(x) for x in mobius.rotation]
    size, inside = sum(x * x for x in q), 1 - sum(x * x for x in h)
    turn = _turning(q)
    sign = -1 if mobius.reflected else 1
    result = np.zeros(len(m), bool)
    for i, (x, y, radius) in enumerate(zip(m.tolist(), b.tolist(), rho.tolist(), strict=True)):
        w = [Fraction(c) * s - a for c, s, a in zip(x, (1, sign, 1), h, strict=True)]
        square = sum(c * c for c in w)
        moved = [inside * c - square * a for c, a in zip(w, h, strict=True)]
        scale = square * size
        off = [
            sum(t * c for t, c in zip(row, moved, strict=True)) - scale * Fraction(c)
            for row, c in zip(turn, y, strict=True)
        ]
        result[i] = sum(c * c for c in off) <= (Fraction(radius) * scale) ** 2
    return result


def _turning(q: list[Fraction]) -> list[list[Fraction]]:
    """Return the matrix of x -> q x conj(q)."""
    w, x, y, z = q
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def sphere_matching(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    check: Callable[[], None] = nothing,
) -> SphereMatching:
    """Check the input of a search and list its compatible pairs; see `sphere_search` for the parameters.

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, points off the unit sphere by more than 1e-9, radii out of range,
        weights outside [0, 1], too many pairs.
    """
    m, b = _points(source, "source"), _points(target, "target")
    e = np.asarray(radius, dtype=np.float64)
    if e.ndim > 1 or (e.ndim == 1 and len(e) != len(b)):
        raise ValueError(f"radius must be one number or one per target point ({len(b)}), not of shape {e.shape}")
    e = np.array(np.broadcast_to(e, (len(b),)))
    if not (np.isfinite(e).all() and (e >= LEAST_RADIUS).all() and (e <= 2).all()):
        raise ValueError(f"every radius must be a chord of the unit sphere between {LEAST_RADIUS} and 2")
    rows, unit = (None, 1.0) if weights is None else rows_of(np.asarray(weights), (len(m), len(b)), check)
    found = SphereMatching(m, b, e, rows, unit)
    if found.count > MOST_PAIRS:
        raise too_many(found.count)
    return found


def _points(points: npt.ArrayLike, role: str) -> Floats:
    """Return points of the unit sphere, of length 1 to rounding, or raise ValueError."""
    x = np.asarray(points, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 3 or len(x) == 0:
        raise ValueError(f"the {role} must be points of shape (n, 3), not {x.shape}")
    if not np.isfinite(x).all():
        raise ValueError(f"the {role} has points that are not finite")
    length = np.linalg.norm(x, axis=1)
    if (off := np.abs(length - 1) > 1e-9).any():
        raise ValueError(f"the {role} has points off the unit sphere (the first is number {np.argmax(off)})")
    return x / length[:, None]
