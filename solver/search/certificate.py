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

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from ..mobius import Mobius
from ..surface.mesh import Booleans, Complexes, Floats
from .rational import exactly, root_up, sides, square, turn

MARGIN = 2.0**-40
"""More than any rounding below: numbers of at most 8 after fewer than 100 operations are off by less than 2^-43."""


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
        Whether the claimed value lies between these, up to the rounding of weights (half a unit, see `Matching.unit`),
        by a transformation of those that were searched: |z| <= z_max, and reflected only where that was allowed.
    bound_holds : bool or None
        Whether no transformation was shown to exceed the claimed upper bound: True if proved over the whole domain,
        False if the boxes ran out before, and if the bound is no finite number or below what `mobius` certainly
        reaches. None if not asked for.
    boxes : int
        Boxes of the final cover.
    objections : tuple of str
        What speaks against the claim, a sentence each; what only has not been proved is none.
    """

    value: float
    possible: float
    value_holds: bool
    bound_holds: bool | None = None
    boxes: int = 0
    objections: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Every pair of positive weight, as given: nothing is converted or rounded.

    But points up to 1e-12 outside of the circle are moved onto it, by the rule of the search.
    """

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

    Raises
    ------
    ValueError
        The input is none that can be searched: wrong shapes, an unknown metric, anything not finite or out of range;
        the text names which. What is wrong with the claim itself is among the `objections`.

    Examples
    --------
    >>> certify(Mobius(), 1.0, 1.0, [0.5], [0.5], 0.1).value_holds
    True
    """
    pairs, rounding = _checked(source, target, radius, metric, weights, z_max)
    low, high = _value(pairs, mobius)
    objections = _outside(mobius, z_max, reflect)
    inside = not objections
    for name, number in (("value", value), ("upper bound", upper_bound)):
        if not np.isfinite(number):
            objections.append(f"the {name} is not a finite number: {number}")
    reached = bool(low - rounding <= value <= high + rounding)  # nan is not
    if np.isfinite(value) and not reached:
        objections.append(f"the transformation matches {low if low == high else f'{low} to {high}'}, not {value}")
    below = bool(upper_bound + rounding < low) and inside
    if below:
        objections.append(f"the upper bound {upper_bound} is below the {low} that the transformation matches")
    bounded = False if below or not np.isfinite(upper_bound) else None
    boxes = 0
    if prove and bounded is None:
        bounded, boxes = _proved(pairs, upper_bound + rounding, z_max, reflect, exact, most_boxes)
    return Certificate(low, high, inside and reached, bounded, boxes, tuple(objections))


def _checked(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    metric: str,
    weights: npt.ArrayLike | None,
    z_max: float,
) -> tuple[_Pairs, float]:
    """Return the pairs, and by how much the search may round their sum; raise ValueError if nothing can be searched."""
    m, b = (np.asarray(points, np.complex128) for points in (source, target))
    tau = np.asarray(radius, np.float64)
    for name, points in (("source", m), ("target", b)):
        if points.ndim != 1 or len(points) == 0:
            raise ValueError(f"the {name} must be a flat, non-empty array, not of shape {points.shape}")
        if not np.isfinite(points).all() or (np.abs(points) > 1 + 1e-12).any():
            raise ValueError(f"the {name} must be finite points of the unit disc")
    m, b = (points / np.maximum(np.abs(points), 1) for points in (m, b))
    if tau.shape not in ((), b.shape):
        raise ValueError(f"radius must be one number or one per target point, not of shape {tau.shape}")
    if not (np.isfinite(tau).all() and (tau > 0).all()):
        raise ValueError("every radius must be a finite number above 0")
    if metric not in ("hyperbolic", "euclidean"):
        raise ValueError(f"unknown metric '{metric}': use 'hyperbolic' or 'euclidean'")
    if metric == "hyperbolic" and not (tau < 1).all():
        raise ValueError("a hyperbolic radius must be below 1")
    if metric == "hyperbolic" and any(square(exactly(x)) >= 1 for x in b.tolist()):
        raise ValueError("hyperbolic match discs need target points inside the unit circle")
    if not 0 < z_max < 1:  # nan is neither
        raise ValueError(f"z_max must lie between 0 and 1, not {z_max}")
    table = np.ones((len(m), len(b))) if weights is None else np.asarray(weights, np.float64)
    if table.shape != (len(m), len(b)):
        raise ValueError(f"weights must be of shape {(len(m), len(b))}, not {table.shape}")
    if not ((table >= 0) & (table <= 1)).all():
        raise ValueError("every weight must lie in [0, 1]")
    j, k = np.nonzero(table)
    tau = np.broadcast_to(tau, b.shape)
    # whole weights are not rounded by the search, others to 2^-20 or, beyond 2,047 points, coarser
    rounding = 0.0 if ((table == 0) | (table == 1)).all() else len(m) * max(2.0**-21, len(m) * 2.0**-31)
    return _Pairs(j, m[j], b[k], tau[k], table[j, k], metric == "hyperbolic", len(m)), rounding


def _outside(mobius: Mobius, z_max: float, reflect: bool) -> list[str]:
    """Say why a transformation is none of those that were searched."""
    said = []
    if not square(exactly(mobius.z)) <= Fraction(float(z_max)) ** 2:
        said.append(f"|z| of the transformation is {abs(mobius.z)}, beyond z_max = {z_max}")
    if mobius.reflected and not reflect:
        said.append("the transformation is reflected, and reflections were not searched")
    return said


def _proved(pairs: _Pairs, bound: float, z_max: float, reflect: bool, exact: bool, most_boxes: int) -> tuple[bool, int]:
    """Return whether nothing in the domain exceeds `bound`, and how many boxes it took to see."""
    proved, boxes = True, 0
    for conjugated in (False, True) if reflect else (False,):
        side = replace(pairs, m=np.conj(pairs.m)) if conjugated else pairs
        cover = _cover(side, bound, z_max, most_boxes - boxes)
        if cover is None:
            return False, most_boxes
        boxes += len(cover)
        proved = proved and (not exact or all(_holds_exactly(side, box, bound) for box in cover))
    return proved, boxes


def _value(pairs: _Pairs, mobius: Mobius) -> tuple[float, float]:
    """Return the weight that is matched for certain, and with every pair that is too close to call."""
    z, u, off = exactly(mobius.z), *turn(mobius.theta)
    sure, maybe = np.zeros(len(pairs.m), bool), np.zeros(len(pairs.m), bool)
    for i, (m, b, tau) in enumerate(zip(pairs.m.tolist(), pairs.b.tolist(), pairs.tau.tolist(), strict=True)):
        a2, b2 = sides(exactly(m.conjugate() if mobius.reflected else m), exactly(b), z, u, pairs.hyperbolic)
        room = Fraction(tau) ** 2 * b2 - a2
        # both sides have |.| <= 4 and move by at most 2 |u - exp(i theta)|
        sure[i], maybe[i] = room >= 64 * off, room >= -64 * off
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
    u, off = turn(theta)
    t += 2 * off  # u is off by that much, which is as if theta were
    r = half * root_up(Fraction(2))
    alive = np.ones((1, len(pairs.m)), bool)
    # only what the float arithmetic called dead can be shown dead
    for i in np.flatnonzero(~_alive(pairs, box[None])[0]).tolist():
        m, b, tau = exactly(complex(pairs.m[i])), exactly(complex(pairs.b[i])), Fraction(float(pairs.tau[i]))
        size_m, size_b = root_up(square(m)), root_up(square(b))
        distance = root_up(square((m[0] - x, m[1] - y)))
        step = r + t * (distance + r)
        a2, b2 = sides(m, b, z, u, pairs.hyperbolic)
        move_b = r * size_m + (size_b * step if pairs.hyperbolic else 0)
        reach = tau * root_up(b2) + step + size_b * r * size_m + tau * move_b
        # u itself is not exactly on the circle
        alive[0, i] = a2 <= (reach + 8 * off) ** 2
    return bool(pairs.worth(alive)[0] <= bound)
