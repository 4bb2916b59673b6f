"""Arcs of rotations that match a pair: exactly for one z, and enclosing those of all z in a disc.

Le, Chin and Suter (2016), section 4. For z in the disc R = (c, r) the image h = (m - z) / (1 - conj(z) m) of a source
point has its modulus in [r1, r2] and its argument in alpha +- delta; the pair (m, disc(b, e)) is matched by a theta in
arg b - alpha +- (delta + beta), beta being half the widest angle under which the disc of b is seen from the centre at a
radius in [r1, r2].

Rounding. With u = 2^-53, each expression below states a multiple of u by which its computed value can be off, and is
moved outward by more than that; thus every enclosing arc holds the arcs of all z in R in exact arithmetic. The cell
centres are exact in float64 (dyadic numbers), the cell radius is given rounded up.
"""

from __future__ import annotations

import numpy as np

from .matching import Matching
from .mesh import Complexes, Floats, Integers

U = 2.0**-53
Arcs = tuple[Integers, Integers, Floats, Floats]
"""Row of z or cell, pair, centre and half-width in radians; arcs that are empty are left out."""


def exact_arcs(matching: Matching, z: Complexes) -> Arcs:
    """Return, for each z, (C,), and each pair that some rotation matches, the arc of those rotations (eq. 10-14).

    To rounding error, in both directions: a value found with these is to be confirmed by `Matching.value`.
    """
    m = matching.source
    h = (m - z[:, None]) / (1 - np.conj(z)[:, None] * m)
    modulus = np.abs(h)[:, matching.point]
    b = np.abs(matching.centre)
    row, pair = np.nonzero(np.abs(modulus - b) <= matching.radius)
    alpha = np.angle(h)[row, matching.point[pair]]
    half_width = _half_angle(modulus[row, pair], b[pair], matching.radius[pair])
    return row, pair, np.angle(matching.centre)[pair] - alpha, half_width


def enclosing_arcs(matching: Matching, centre: Complexes, radius: Floats) -> Arcs:
    """Return, for each disc (centre, radius) of z, (C,), and each pair, an arc that holds every matching rotation."""
    alpha, delta, near, far = _images(matching.source, centre, radius)
    b, e = np.abs(matching.centre), matching.radius
    # |b| is off by 2 u |b| <= 2 u
    outer = (b + e) * (1 + 4 * U) + 4 * U
    inner = (b - e) - 4 * U * (1 + e)
    row, pair = np.nonzero((near[:, matching.point] <= outer) & (far[:, matching.point] >= inner))
    j = matching.point[pair]
    beta = _widest_half_angle(near[row, j], far[row, j], b[pair], e[pair])
    # the angles are off by 2 u of at most pi each, their sums and the reduction to [0, 2 pi] by less than 40 u in all
    half_width = delta[row, j] + beta + 128 * U
    return row, pair, np.angle(matching.centre)[pair] - alpha[row, j], half_width


def _images(m: Complexes, c: Complexes, r: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Enclose h(m | z) for all z in the discs (c, r): argument alpha +- delta, modulus [near, far]; each (C, N1)."""
    c, r = c[:, None], r[:, None]
    away = m - c
    facing = 1 - np.conj(m) * c
    away_length, facing_length = np.abs(away), np.abs(facing)
    # each component of conj(m) c is off by 3 u at most and 1 - . adds one rounding: |facing| is off by less than 12 u
    facing_low = np.maximum(facing_length - 12 * U, 0)
    reach = np.abs(m) * r * (1 + 8 * U)
    room = facing_low - reach

    # argument: arg(m - z) and arg(1 - conj(m) z) each turn by at most an arc sine (eq. 26-29)
    # |m - c| is off by 4 u of itself
    sine1 = r / np.maximum(away_length * (1 - 8 * U), np.finfo(float).tiny)
    sine2 = reach / np.maximum(facing_low, np.finfo(float).tiny)
    turns = (sine1 >= 1 - 4 * U) | (sine2 >= 1 - 4 * U)
    delta = np.arcsin(np.minimum(sine1 * (1 + 4 * U), 1)) + np.arcsin(np.minimum(sine2 * (1 + 4 * U), 1))
    # arg(facing) is off by 12 u / |facing|, arg(m - c) by 4 u, the sum of both by 8 u
    delta += 16 * U / np.maximum(facing_low, U) + 32 * U
    delta[turns] = np.pi
    alpha = np.angle(away) + np.angle(facing)

    # modulus: |h(m | z)| = |(z - m) / (1 - conj(m) z)|, which carries the disc (c, r) to a disc (eq. 20-22) unless the
    # pole 1 / conj(m) lies in it
    pole = room <= 1e-7
    span = np.where(pole, 1.0, (facing_length - reach) * (facing_length + reach))
    middle = np.abs(m * r**2 - away * np.conj(facing)) / span
    spread = r * np.maximum((1 - np.abs(m)) * (1 + np.abs(m)) + 8 * U, 0) / span
    # numerators are off by 40 u, and span, a product with one factor near room, by 24 u / room of itself
    slack = (64 * U + (middle + spread) * (64 * U + 64 * U / np.maximum(room, 1e-7))) / np.minimum(span, 1)
    near = np.where(pole, 0.0, np.maximum(middle - spread - slack, 0))
    far = np.where(pole, 1.0, np.minimum(middle + spread + slack, 1))
    return alpha, delta, near, np.maximum(far, near)


def _half_angle(rho: Floats, b: Floats, e: Floats) -> Floats:
    """Return half the angle that disc(b, e) covers of the circle of radius rho, pi if it holds all of it (eq. 12)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (rho**2 + (b - e) * (b + e)) / (2 * rho * b)
    return np.where(rho + b <= e, np.pi, np.arccos(np.clip(np.nan_to_num(cosine, nan=1.0), -1, 1)))


def _widest_half_angle(near: Floats, far: Floats, b: Floats, e: Floats) -> Floats:
    """Return an upper bound of `_half_angle` over rho in [near, far] (eq. 30-32, the tangent case included)."""
    # the widest circle touches the disc's tangents, at rho^2 = b^2 - e^2; the angle falls off to both sides
    tangent = np.sqrt(np.maximum((b - e) * (b + e), 0))
    rho = np.clip(tangent, near, far)
    product = 2 * rho * b
    total = rho**2 + (b - e) * (b + e)
    # both are off by less than 8 u (rho^2 + b^2 + e^2), and the quotient must err towards the wider angle
    error = 16 * U * (rho**2 + b**2 + e**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (total - error) / product
        cosine = np.where(
            cosine < 0, (total - error) / np.maximum(product - error, 0), (total - error) / (product + error)
        )
    wide = np.arccos(np.clip(cosine, -1, 1)) + 8 * U
    return np.where((near + b <= e * (1 + 4 * U) + 4 * U) | np.isnan(cosine), np.pi, wide)
