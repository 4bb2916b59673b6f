"""A check of a finished search on the sphere by code that shares nothing with it.

The value is recomputed in exact rational arithmetic from f(x) = q T_h(x) conj(q) / |q|^2. The upper bound is proved
again, on request, over a cover of all rotations and h by boxes, with another bound than the search's. A rotation is a
quaternion one of whose coordinates is 1 and the others at most that; coordinates that differ by d in length are
quaternions at most atan(d) <= d apart, and rotations at most 2 d. |dT_h(m) / dh| <= 2 / |m - h| <= 2 / (1 - |h|). So a
pair is dead in a box if |f(m) - b| at its centre exceeds

    rho + 2 d + 2 r / (1 - |h0| - r)

and Q in the box is at most the sum over source points of the largest weight of a pair that is not dead.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import numpy.typing as npt

from ..mobius import SphereMobius
from ..surface.mesh import Floats
from .certificate import MARGIN, Certificate


def certify_sphere(
    mobius: SphereMobius,
    value: float,
    upper_bound: float,
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    h_max: float = 0.2,
    reflect: bool = False,
    prove: bool = False,
    most_boxes: int = 2_000_000,
) -> Certificate:
    """Check what a search on the sphere claims about its input.

    Parameters
    ----------
    mobius, value, upper_bound
        The claim: `mobius` reaches `value`, and no transformation with |h| <= h_max exceeds `upper_bound`; with h_max =
        0, no rotation.
    source, target, radius, weights, h_max, reflect
        The input of the search.
    prove : bool
        Prove the upper bound again. The work grows like the sixth power of 1 / radius, the cube with h_max = 0: for
        small cases.
    most_boxes : int
        Give up beyond this many boxes.

    Raises
    ------
    ValueError
        The input is none that can be searched: wrong shapes, anything not finite or out of range; the text names which.
        What is wrong with the claim itself is among the `objections`.
    """
    m, b, rho, table = _checked(source, target, radius, weights, h_max)
    rounding = 0.0 if ((table == 0) | (table == 1)).all() else len(m) * max(2.0**-21, len(m) * 2.0**-31)
    reached = _value(mobius, m, b, rho, table)
    objections = []
    if sum(Fraction(x) ** 2 for x in mobius.h) > Fraction(h_max) ** 2:
        objections.append(f"|h| of the transformation is beyond h_max = {h_max}")
    if mobius.reflected and not reflect:
        objections.append("the transformation is reflected, and reflections were not searched")
    inside = not objections
    for name, number in (("value", value), ("upper bound", upper_bound)):
        if not np.isfinite(number):
            objections.append(f"the {name} is not a finite number: {number}")
    holds = bool(abs(reached - value) <= rounding)
    if not holds:
        objections.append(f"the transformation matches {reached}, not {value}")
    below = bool(upper_bound + rounding < reached) and inside
    if below:
        objections.append(f"the upper bound {upper_bound} is below the {reached} that the transformation matches")
    bounded, boxes = (False if below or not np.isfinite(upper_bound) else None), 0
    if prove and bounded is None:
        bounded = True
        for sign in (1.0, -1.0) if reflect else (1.0,):
            count = _cover(m * [1, sign, 1], b, rho, table, upper_bound + rounding, h_max, most_boxes - boxes)
            bounded, boxes = bounded and count is not None, boxes + (count or most_boxes)
    return Certificate(reached, reached, inside and holds, bounded, boxes, tuple(objections))


def _checked(
    source: npt.ArrayLike, target: npt.ArrayLike, radius: npt.ArrayLike, weights: npt.ArrayLike | None, h_max: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return points, radii and weights, or raise ValueError: by the rules of the search, and by other code."""
    if not 0 <= h_max < 1:  # nan is neither
        raise ValueError(f"h_max must be 0 or more and below 1, not {h_max}")
    m, b = (np.asarray(x, np.float64) for x in (source, target))
    for name, points in (("source", m), ("target", b)):
        if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
            raise ValueError(f"the {name} must be points of shape (n, 3), not {points.shape}")
        if not (np.abs(np.linalg.norm(points, axis=1) - 1) <= 1e-9).all():
            raise ValueError(f"the {name} must be finite points of the unit sphere")
    m, b = (x / np.linalg.norm(x, axis=1)[:, None] for x in (m, b))
    rho = np.asarray(radius, np.float64)
    if rho.shape not in ((), (len(b),)):
        raise ValueError(f"radius must be one number or one per target point, not of shape {rho.shape}")
    if not ((rho > 0) & (rho <= 2)).all():
        raise ValueError("every radius must be a chord of the unit sphere, above 0 and at most 2")
    table = np.ones((len(m), len(b))) if weights is None else np.asarray(weights, np.float64)
    if table.shape != (len(m), len(b)):
        raise ValueError(f"weights must be of shape {(len(m), len(b))}, not {table.shape}")
    if not ((table >= 0) & (table <= 1)).all():
        raise ValueError("every weight must lie in [0, 1]")
    return m, b, np.broadcast_to(rho, (len(b),)), table


def _value(mobius: SphereMobius, m: Floats, b: Floats, rho: Floats, table: Floats) -> float:
    """Return the weight that is matched, in exact arithmetic."""
    q, h = [Fraction(x) for x in mobius.rotation], [Fraction(x) for x in mobius.h]
    size, short = sum(x * x for x in q), sum(x * x for x in h)
    total = 0.0
    for j, point in enumerate(m.tolist()):
        x = [Fraction(c) for c in point]
        x[1] = -x[1] if mobius.reflected else x[1]
        away = [c - a for c, a in zip(x, h, strict=True)]
        square = sum(c * c for c in away)
        moved = [Fraction(0), *(((1 - short) * c) / square - a for c, a in zip(away, h, strict=True))]
        image = _times(_times(q, moved), [q[0], -q[1], -q[2], -q[3]])[1:]
        best = 0.0
        for k in np.flatnonzero(table[j]).tolist():
            off = sum((c / size - Fraction(a)) ** 2 for c, a in zip(image, b[k].tolist(), strict=True))
            if off <= Fraction(float(rho[k])) ** 2:
                best = max(best, float(table[j, k]))
        total += best
    return total


def _times(p: list[Fraction], q: list[Fraction]) -> list[Fraction]:
    """Return the product of two quaternions."""
    a, b, c, d = p
    e, f, g, h = q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]


def _cover(m: Floats, b: Floats, rho: Floats, table: Floats, bound: float, h_max: float, most_boxes: int) -> int | None:
    """Return how many boxes (face, a, b, c, half, h, half of h) cover the domain and hold `bound` at most, or None."""
    count = 0
    open_boxes = np.zeros((4, 9))
    open_boxes[:, 0], open_boxes[:, 4], open_boxes[:, 8] = range(4), 1, h_max
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) * 2.0 - 1
    while len(open_boxes):
        some, open_boxes = open_boxes[-256:], open_boxes[:-256]
        r = 1.7320508075689 * some[:, 8]
        by_h = (2 * r / np.maximum(1 - np.linalg.norm(some[:, 5:8], axis=1) - r, 0.01)) > 3.5 * some[:, 4]
        boxes = np.repeat(some, 8, axis=0)
        step = np.tile(corners, (len(some), 1))
        turn, shift = np.repeat(~by_h, 8), np.repeat(by_h, 8)
        boxes[turn, 4] /= 2
        boxes[turn, 1:4] += boxes[turn, 4:5] * step[turn]
        boxes[shift, 8] /= 2
        boxes[shift, 5:8] += boxes[shift, 8:9] * step[shift]
        nearest = np.maximum(np.abs(boxes[:, 5:8]) - boxes[:, 8:9], 0)
        boxes = boxes[np.linalg.norm(nearest, axis=1) <= h_max + MARGIN]
        settled = _most(m, b, rho, table, boxes) <= bound
        count += int(settled.sum())
        open_boxes = np.concatenate([open_boxes, boxes[~settled]])
        if count + len(open_boxes) > most_boxes or (len(boxes) and boxes[:, 4].min() < MARGIN):
            return None
    return count


def _most(m: Floats, b: Floats, rho: Floats, table: Floats, boxes: Floats) -> Floats:
    """Return what Q does not exceed in each box, (n,)."""
    q = np.ones((len(boxes), 4))
    for face in range(4):
        rows = boxes[:, 0] == face
        q[np.ix_(rows, [k for k in range(4) if k != face])] = boxes[rows, 1:4]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    h = boxes[:, 5:8]
    r = 1.7320508075689 * boxes[:, 8]
    room = 1 - np.linalg.norm(h, axis=1) - r
    away = m - h[:, None]
    moved = away * ((1 - (h**2).sum(axis=1))[:, None] / (away**2).sum(axis=2))[:, :, None] - h[:, None]
    axis = q[:, None, 1:]
    cross = np.cross(axis, moved)
    image = moved + 2 * (q[:, None, :1] * cross + np.cross(axis, cross))
    move = 2 * 1.7320508075689 * boxes[:, 4] + np.where(room > 0.01, 2 * r / np.maximum(room, 0.01), 9)
    apart = np.linalg.norm(image[:, :, None] - b, axis=3)
    alive = apart <= rho + move[:, None, None] + MARGIN
    return np.where(alive, table, 0).max(axis=2).sum(axis=1)
