"""A check of a finished search by code that shares nothing with it.

The value is recomputed from Le, Chin and Suter (2016), eq. 1, in exact rational arithmetic. The upper bound is proved
again, on request, over a cover of all (z, theta) by boxes, with another bound than the search's: the pair (m, b) is
matched at (z, u), u = exp(i theta), if |A| <= tau |B|, where, without a division,

    hyperbolic:  A = u (m - z) - b (1 - conj(z) m),   B = (1 - conj(z) m) - conj(b) u (m - z)
    Euclidean:   the same A,                          B = 1 - conj(z) m

For |z - z0| <= r and |theta - theta0| <= t, u (m - z) moves by at most r + t (|m - z0| + r) and 1 - conj(z) m by at
most r |m|. So the pair is dead in the whole box if |A| - tau |B| at its centre exceeds

    s + r |b| |m| + tau (r |m| + |b| s),   s = r + t (|m - z0| + r)      (Euclidean: tau r |m| at the end)

and Q in the box is at most the sum over source points of the largest weight of a pair that is not dead.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt

import numpy as np
import numpy.typing as npt

from ..mobius import Mobius
from ..surface.mesh import Booleans, Complexes, Floats

MARGIN = 2.0**-40
"""More than any rounding below: numbers of at most 8 after fewer than 100 operations are off by less than 2^-43."""

BITS = 160
"""Of the fixed-point numbers that stand for exp(i theta)."""


@dataclass(frozen=True)
class Certificate:
    """What a check has established.

    Attributes
    ----------
    value : float
        The weight that the transformation certainly matches.
    possible : float
        The weight that it matches if every pair too close to call (within 2^-100) is counted.
    value_holds : bool
        Whether the claimed value lies between these, up to the rounding of weights (half a unit, see `Matching.unit`).
    bound_holds : bool or None
        Whether no transformation was shown to exceed the claimed upper bound: True if proved over the whole domain,
        False if the boxes ran out before. None if not asked for.
    boxes : int
        Boxes of the final cover.
    """

    value: float
    possible: float
    value_holds: bool
    bound_holds: bool | None = None
    boxes: int = 0


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Every pair of positive weight, as given: nothing is converted or rounded."""

    point: npt.NDArray[np.intp]
    m: Complexes
    b: Complexes
    tau: Floats
    weight: Floats
    hyperbolic: bool
    points: int

    def worth(self, alive: Booleans) -> Floats:
        """Return the sum over source points of the largest weight of a pair that is alive, for each row of (n, P)."""
        best = np.zeros((self.points, len(alive)))
        np.maximum.at(best, self.point, np.where(alive, self.weight, 0).T)
        return best.sum(axis=0)


def certify(
    mobius: Mobius,
    value: float,
    upper_bound: float,
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
    z_max: float = 0.95,
    reflect: bool = False,
    prove: bool = False,
    exact: bool = False,
    most_boxes: int = 2_000_000,
) -> Certificate:
    """Check what a search claims about its input.

    Parameters
    ----------
    mobius, value, upper_bound
        The claim: `mobius` reaches `value`, and nothing exceeds `upper_bound`.
    source, target, radius, metric, weights, z_max, reflect
        The input of the search.
    prove : bool
        Prove the upper bound again. The work grows like the cube of 1 / radius: for small cases.
    exact : bool
        Go over the cover a second time in rational arithmetic, which takes about a thousand times longer.
    most_boxes : int
        Give up beyond this many boxes.

    Examples
    --------
    >>> certify(Mobius(), 1.0, 1.0, [0.5], [0.5], 0.1).value_holds
    True
    """
    m = np.asarray(source, np.complex128)
    b = np.asarray(target, np.complex128)
    table = np.ones((len(m), len(b))) if weights is None else np.asarray(weights, np.float64)
    j, k = np.nonzero(table > 0)
    tau = np.broadcast_to(np.asarray(radius, np.float64), b.shape)
    pairs = _Pairs(j, m[j], b[k], tau[k], table[j, k], metric == "hyperbolic", len(m))
    low, high = _value(pairs, mobius)
    # whole weights are not rounded by the search, others to 2^-20 or, beyond 2,047 points, coarser
    rounding = 0.0 if np.isin(table, (0, 1)).all() else len(m) * max(2.0**-21, len(m) * 2.0**-31)
    holds = low - rounding <= value <= high + rounding
    if not prove:
        return Certificate(low, high, holds)
    proved, boxes = True, 0
    for conjugated in (False, True) if reflect else (False,):
        side = _Pairs(j, np.conj(m[j]) if conjugated else m[j], b[k], tau[k], table[j, k], pairs.hyperbolic, len(m))
        cover = _cover(side, upper_bound + rounding, z_max, most_boxes - boxes)
        if cover is None:
            return Certificate(low, high, holds, False, most_boxes)
        boxes += len(cover)
        proved = proved and (not exact or all(_holds_exactly(side, box, upper_bound + rounding) for box in cover))
    return Certificate(low, high, holds, proved, boxes)


def _value(pairs: _Pairs, mobius: Mobius) -> tuple[float, float]:
    """Return the weight that is matched for certain, and with every pair that is too close to call."""
    z, u, off = _exactly(mobius.z), *_turn(mobius.theta)
    sure, maybe = np.zeros(len(pairs.m), bool), np.zeros(len(pairs.m), bool)
    for i, (m, b, tau) in enumerate(zip(pairs.m.tolist(), pairs.b.tolist(), pairs.tau.tolist(), strict=True)):
        a2, b2 = _sides(_exactly(m.conjugate() if mobius.reflected else m), _exactly(b), z, u, pairs.hyperbolic)
        room = Fraction(tau) ** 2 * b2 - a2
        # both sides have |.| <= 4 and move by at most 2 |u - exp(i theta)|
        sure[i], maybe[i] = room > 64 * off, room >= -64 * off
    low, high = pairs.worth(np.stack([sure, maybe]))
    return float(low), float(high)


def _cover(pairs: _Pairs, bound: float, z_max: float, most_boxes: int) -> Floats | None:
    """Return boxes (x, y, half, theta, t) that cover the domain and hold at most `bound` each, or None if too many."""
    done: list[Floats] = []
    count = 0
    open_boxes = np.array([[0.0, 0.0, 1.0, 0.0, 4.0]])
    while len(open_boxes):
        some, open_boxes = open_boxes[-512:], open_boxes[:-512]
        # in radians per length: an image turns by |m - z| per theta and moves by up to 2 per z
        wide = some[:, 4] > 2 * some[:, 2]
        z_pieces = [some[~wide] * [1, 1, 0.5, 1, 1] + np.outer(some[~wide, 2], [x, y, 0, 0, 0]) for x, y in _CORNERS]
        t_pieces = [some[wide] * [1, 1, 1, 1, 0.5] + np.outer(some[wide, 4], [0, 0, 0, x, 0]) for x in (-0.5, 0.5)]
        boxes = np.concatenate(z_pieces + t_pieces)
        x, y, half = np.abs(boxes[:, 0]), np.abs(boxes[:, 1]), boxes[:, 2]
        boxes = boxes[np.hypot(np.maximum(x - half, 0), np.maximum(y - half, 0)) <= z_max + MARGIN]
        settled = pairs.worth(_alive(pairs, boxes)) <= bound
        done.append(boxes[settled])
        count += int(settled.sum())
        open_boxes = np.concatenate([open_boxes, boxes[~settled]])
        if count + len(open_boxes) > most_boxes or (len(boxes) and boxes[:, 2].min() < MARGIN):
            return None
    return np.concatenate(done) if done else np.zeros((0, 5))


_CORNERS = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]


def _alive(pairs: _Pairs, boxes: Floats) -> Booleans:
    """Return, for each box and pair, whether the pair cannot be ruled out, (n, P)."""
    z = (boxes[:, 0] + 1j * boxes[:, 1])[:, None]
    r, t = boxes[:, 2:3] * 1.4142135623731, boxes[:, 4:5]
    moved = np.exp(1j * boxes[:, 3:4]) * (pairs.m - z)
    facing = 1 - np.conj(z) * pairs.m
    m, b, tau = np.abs(pairs.m), np.abs(pairs.b), pairs.tau
    step = r + t * (np.abs(pairs.m - z) + r)
    move_a = step + b * r * m
    if pairs.hyperbolic:
        value_b, move_b = facing - np.conj(pairs.b) * moved, r * m + b * step
    else:
        value_b, move_b = facing, r * m
    return np.abs(moved - pairs.b * facing) - tau * np.abs(value_b) <= move_a + tau * move_b + MARGIN


def _holds_exactly(pairs: _Pairs, box: Floats, bound: float) -> bool:
    """Return whether a box holds at most `bound`, by rational arithmetic alone."""
    x, y, half, theta, t = (Fraction(v) for v in box.tolist())
    z = x, y
    u, off = _turn(theta)
    t += 2 * off  # u is off by that much, which is as if theta were
    r = half * _root_up(Fraction(2))
    alive = np.ones((1, len(pairs.m)), bool)
    # only what the float arithmetic called dead can be shown dead
    for i in np.flatnonzero(~_alive(pairs, box[None])[0]).tolist():
        m, b, tau = _exactly(complex(pairs.m[i])), _exactly(complex(pairs.b[i])), Fraction(float(pairs.tau[i]))
        size_m, size_b = _root_up(_square(m)), _root_up(_square(b))
        distance = _root_up(_square((m[0] - x, m[1] - y)))
        step = r + t * (distance + r)
        a2, b2 = _sides(m, b, z, u, pairs.hyperbolic)
        move_b = r * size_m + (size_b * step if pairs.hyperbolic else 0)
        reach = tau * _root_up(b2) + step + size_b * r * size_m + tau * move_b
        # u itself is not exactly on the circle
        alive[0, i] = a2 <= (reach + 8 * off) ** 2
    return bool(pairs.worth(alive)[0] <= bound)


_Exact = tuple[Fraction, Fraction]


def _exactly(x: complex) -> _Exact:
    return Fraction(float(x.real)), Fraction(float(x.imag))


def _square(x: _Exact) -> Fraction:
    return x[0] * x[0] + x[1] * x[1]


def _times(x: _Exact, y: _Exact) -> _Exact:
    return x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]


def _sides(m: _Exact, b: _Exact, z: _Exact, u: _Exact, hyperbolic: bool) -> tuple[Fraction, Fraction]:
    """Return |A|^2 and |B|^2 of the module's notes."""
    moved = _times(u, (m[0] - z[0], m[1] - z[1]))
    product = _times((z[0], -z[1]), m)
    facing = 1 - product[0], -product[1]
    carried = _times(b, facing)
    a = moved[0] - carried[0], moved[1] - carried[1]
    if not hyperbolic:
        return _square(a), _square(facing)
    back = _times((b[0], -b[1]), moved)
    return _square(a), _square((facing[0] - back[0], facing[1] - back[1]))


def _root_up(x: Fraction) -> Fraction:
    """Return an upper bound of the square root, off by less than 2^-60."""
    return Fraction(isqrt((x.numerator << 120) // x.denominator) + 1, 1 << 60)


def _turn(theta: float | Fraction) -> tuple[_Exact, Fraction]:
    """Return exp(i theta) in rational numbers, and by how much it may be off."""
    x = Fraction(theta)
    one = 1 << BITS
    angle = x.numerator * one // x.denominator
    # the series, in fixed point: terms fall off once their number exceeds |theta|
    real, imag, term_real, term_imag, n = one, 0, one, 0, 0
    while term_real or term_imag:
        n += 1
        term_real, term_imag = -term_imag * angle // (n * one), term_real * angle // (n * one)
        if n > 4 * abs(float(x)) + 8 and abs(term_real) <= 1 and abs(term_imag) <= 1:
            break
        real, imag = real + term_real, imag + term_imag
    # every term is rounded by 2, and that grows by |theta|^n / n! <= exp |theta|
    off = Fraction(4 * (n + 2) * int(2 ** (1.5 * abs(float(x)) + 2)), one)
    return (Fraction(real, one), Fraction(imag, one)), off
