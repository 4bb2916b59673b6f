"""What boxes of Möbius transformations of the sphere can match at most.

Notes
-----
*Matrices.* A Möbius transformation of the sphere is a complex 2 x 2 matrix A up to scale, det A != 0; a point m a unit
vector psi of C^2 up to phase, psi psi' = (I + m.s) / 2, s Pauli's matrices, ' the conjugate transpose; f(m) is A psi
(`mobius.spinor_matrix`). With chi the unit vector of -b, |chi' phi| / |phi| is the sine of half the angle between
the point of phi and b, half the chord. So a pair (m, cap(b, rho)) is matched where

    |chi' A psi| <= (rho / 2) |A psi|.                                                                      (1)

*Boxes.* A = a0 I + a1 s1 + a2 s2 + a3 s3, scaled so that the largest |a_i| is 1: its number is the `face`, the other
three are complex numbers of size at most 1. A box: their six real and imaginary parts within half sides of a middle.
Each transformation is in one of the four faces. Of A' A = k I + v.s, k = sum |a_i|^2, v = 2 Re(conj(a0) a) - 2 x X y,
a = x + i y, and for A = R (I - h.s): v / k = -2 h / (1 + |h|^2); so |h| <= h_max is |v| <= `most` k, most = 2 h_max /
(1 + h_max^2).

*Left side of (1).* L = chi' A psi is linear in A: L = L0 + sum d_i c_i for the six real sides, |d_i| <= half_i. With e
= L0 / |L0|, |L| >= Re(conj(e) L) = |L0| + sum d_i Re(conj(e) c_i): no remainder.

*Right side.* |A psi|^2 = k + v.m is a quadratic form. The vector A psi changes by at most `move` = |half of the sides
that turn| + |half of those that do not|, since sum x_i s_i and i sum x_i s_i, x real, change lengths by |x|, and a
face other than 0 is face 0 times a unitary matrix (s1, say: s1 a0 = a0 s1 and s1 a2 s2 = i a2 s3), which makes real
sides imaginary and the other way round, but for those of a0 (`turning`). With n = |A0 psi|, t = sum d_i D_i its change
to first order, |t| <= move, |A psi| = sqrt((n + t)^2 + (q - t^2)), q <= move^2: |A psi| <= n + t + move^2 / (2 (n -
move)), taken if move < n / 2, else n + move.

*Bound.* By both, times |L0|, (1) holds nowhere in the box if

    |L0|^2 - (rho / 2) |L0| (n + rest) > sum half_i |Re(conj(L0) c_i) - (rho / 2) |L0| D_i|.                 (2)

Q is at most the sum over source points of the largest weight of a pair for which that is not so. For each point that
is exact to first order in the box's size; what is lost is that points are asked one by one, each of them best
elsewhere in the box. That is little in six dimensions: of up to six caps whose rims cross a small box in general
position any combination is matched somewhere in it, and of k rims through its middle at random all at once with a
probability of 2^(1 - k) sum_{i < 6} binom(k - 1, i) (Wendel 1962), .62 for 11.

*Rate.* Bounds exceed values by some `slope` times the box's side, so that a gap g near the best transformation needs
sides of g / slope, in a region where values are less than g below the best: some number of boxes that does not depend
on g as long as values fall off linearly there, and grows like g^-6 on a plateau. Halving all six sides costs a factor
of 64; measured on cortices, a head and a brain (100 points, 20,000 pairs): 5 % takes 100,000 to 200,000 boxes, each
percent from there to 1 % some 50,000 to 100,000 more.

*Settled.* (1) holds everywhere in the box if |L0| + move <= (rho / 2) (n - move).

*Domain.* For any unit vector u: |v| - most k >= u.v - most k, which is quadratic in A: at the middle, u = v / |v|,
minus sum half_i times the derivative's size minus (1 + most) sum half_i^2, as |v| <= k = sum half_i^2 for the quadratic
part. If that is positive no transformation of the box is asked for; nor if some |a_i| > 1 throughout.

*Rounding.* Coefficients are below 2, vectors have length 1, sizes stay below 8, and less than 60 operations are done:
L0, c_i and |A0 psi|^2 are off by less than 2^-46, whatever the length of m, which is 1 to 2^-52. |A psi| is at least 1
/ 19 where |h| <= .9, as its largest over its least value is (1 + |h|) / (1 - |h|) and the largest at least 1; so in
boxes that hold such, n is above 1 / 29 where it is divided by; elsewhere it is only not to be too small, and taken as
sqrt(|A0 psi|^2 + 2^-44). Both sides of (2) are then off by less than 2^-43 |L0| + 2^-90; |L0| times `SLACK` = 2^-42
and 2^-90 are taken off the left one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mobius import SphereMobius, from_spinor_matrix, spinor_matrix, spinors
from ..surface.mesh import Floats
from .kernels.boxes import FACE, FREE, MIDDLE, SIDES, coefficients, points, turning
from .matching import Matching

SLACK = 2.0**-42

WIDE = 1.0
"""Boxes that move vectors farther than that are not looked at."""

BOXES_AT_ONCE = 1 << 21
"""Pairs times boxes that are bounded in one go."""


def transformation(box: Floats) -> SphereMobius:
    """Return what the middle of a box stands for."""
    a = coefficients(box[None])[0]
    return from_spinor_matrix(np.array([[a[0] + a[3], a[1] - 1j * a[2]], [a[1] + 1j * a[2], a[0] - a[3]]]))


def place_of(mobius: SphereMobius) -> Floats:
    """Return the box without extent that a transformation, not reflected, is, (15,)."""
    (p, q), (r, s) = spinor_matrix(mobius)
    return points(np.array([[p + s, q + r, 1j * (q - r), p - s]]) / 2)[0]


def caps_of(problem: Any) -> Floats:
    """Return chi, its real and imaginary parts, and rho / 2 of each target point, (N2, 5)."""
    b = spinors(problem.centres)
    away = np.stack([-np.conj(b[:, 1]), np.conj(b[:, 0])], axis=1)
    return np.column_stack([away.view(np.float64), problem.radii / 2])


def pair_coefficients(psi: np.ndarray, caps: Floats) -> np.ndarray:
    """Return chi' psi and chi' s_i psi of pairs, (n, 4) complex; psi (n, 2) complex, caps (n, 5)."""
    u, w = (np.conj(caps[:, 0] + 1j * caps[:, 1])[:, None] * psi).T  # conj(chi1) psi1, conj(chi1) psi2
    x, v = (np.conj(caps[:, 2] + 1j * caps[:, 3])[:, None] * psi).T
    return np.stack([u + v, w + x, 1j * (x - w), u - v], axis=1)


def polar(a: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Return twice k, (...,), and v, (..., 3), of the symmetric form of A' A = k + v.s, of (..., 8) each."""
    k = 2 * (a * d).sum(axis=-1)
    x, y, p, q = a[..., 2::2], a[..., 3::2], d[..., 2::2], d[..., 3::2]
    v = a[..., :1] * p + a[..., 1:2] * q + d[..., :1] * x + d[..., 1:2] * y - np.cross(p, y) - np.cross(x, q)
    return k, 2 * v


def bounds_of(problem: Matching, boxes: Floats, most: float) -> Floats:
    """Return what Q does not exceed in each box, (n,); -1 where no transformation is in it."""
    psi, caps = spinors(problem.source), caps_of(problem)
    pair = pair_coefficients(psi[problem.point], caps[problem.target])
    share = caps[problem.target, 4]
    face = boxes[:, FACE].astype(np.intp)
    side, half = FREE[face], boxes[:, SIDES]
    a = coefficients(boxes)
    flat = a.view(np.float64)
    units = np.zeros((len(boxes), 6, 8))
    columns = np.stack([2 * side, 2 * side + 1], axis=2).reshape(-1, 6)
    np.put_along_axis(units, columns[:, :, None], 1.0, axis=2)
    k0, v0 = (x / 2 for x in polar(flat, flat))
    k1, v1 = polar(flat[:, None], units)
    empty = _outside(boxes, k0, v0, k1, v1, most)
    turns = turning(face)
    move = np.sqrt((half**2 * turns).sum(axis=1)) + np.sqrt((half**2 * ~turns).sum(axis=1))
    move *= 1 + 2.0**-40
    m = problem.source
    size = np.sqrt(np.maximum(k0[:, None] + v0 @ m.T, 0))
    near = move[:, None] < 0.5 * size
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = (k1[:, :, None] + v1 @ m.T) * np.where(near, 0.5 / size, 0)[:, None]
        rest = np.where(near, (move**2)[:, None] / (2 * (size - move[:, None])), move[:, None])
    top = np.sqrt(size**2 + 2.0**-44) + rest
    growth = np.where(near[:, None], growth, 0)
    off = a @ pair.T
    length = np.abs(off)
    beyond = length * (length - SLACK) - share * length * top[:, problem.point] - 2.0**-90
    for i in range(6):
        along = np.conj(off) * np.take_along_axis(pair.T, side[:, i // 2, None], axis=0)
        part = along.imag if i % 2 else along.real
        part = -part if i % 2 else part
        beyond -= half[:, i, None] * np.abs(part - share * length * growth[:, i][:, problem.point])
    alive = np.where((beyond > 0) & (move <= WIDE)[:, None], 0.0, problem.weight)
    bounds = np.zeros(len(boxes))
    filled = np.flatnonzero(np.diff(problem.starts))
    if len(filled):
        bounds = np.maximum.reduceat(alive, problem.starts[filled], axis=1).sum(axis=1)
    return np.where(empty, -1, bounds)


def _outside(boxes: Floats, k0: Floats, v0: Floats, k1: Floats, v1: Floats, most: float) -> np.ndarray:
    """Return in which boxes no transformation is that is asked for, (n,)."""
    half = boxes[:, SIDES]
    nearest = np.maximum(np.abs(boxes[:, MIDDLE]) - half, 0) ** 2
    large = (nearest[:, ::2] + nearest[:, 1::2] > 1 + 2.0**-40).any(axis=1)
    length = np.linalg.norm(v0, axis=1)
    along = np.einsum("ni,nki->nk", v0 / np.maximum(length, 2.0**-20)[:, None], v1)
    beyond = length - most * k0 - (1 + most) * (half**2).sum(axis=1) - (half * np.abs(along - most * k1)).sum(axis=1)
    return large | ((length > 2.0**-20) & (beyond > 2.0**-40))
