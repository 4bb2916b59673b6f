"""Arcs of rotations that match a pair: exactly for one z, and enclosing those of all z in a square cell.

Le, Chin and Suter (2016), section 4, sharpened. The image of a source point m under z alone is
h = (m - z) / (1 - conj(z) m); the pair (m, disc(b, e)) is matched by the rotations theta that turn h into the disc.

Notes
-----
A cell is the square |Re(z - c)|, |Im(z - c)| <= half; it lies in the disc R = (c, r), r = sqrt(2) half. Write
s1 = r / |m - c| and s2 = |m| r / |1 - conj(m) c|. If both are below 1, m and the pole 1 / conj(m) lie outside R.

*Argument.* arg h = Im F with F(z) = log(m - z) + log(1 - conj(m) z), holomorphic in R. Its derivative at c is -D,
D = 1 / (m - c) + conj(m) / (1 - conj(m) c). With u = (z - c) / (m - c), |u| <= s1, the first term of F moves by
log(1 - u) = -u - (u^2/2 + u^3/3 + ...), where what follows -u is at most s1^2 / (2 (1 - s1)) in modulus; the second
term likewise with s2. Hence arg h(z) lies within

    |Im(D (z - c))| + s1^2 / (2 (1 - s1)) + s2^2 / (2 (1 - s2))

of arg h(c), and |Im(D (z - c))| <= half (|Re D| + |Im D|) in the square. The paper's bound is asin(s1) + asin(s2)
(eq. 26-29).

*Common rotation.* theta is free, so for each z the maximum over theta is the maximum over
phi = theta + Im(kappa (z - c)), for any complex kappa: for fixed z this is a translation of the circle onto itself. In
terms of phi, a pair is matched if arg h(z) - Im(kappa (z - c)) + phi is in its arc; so D + kappa takes the place of D
above, and the paper's bound grows by half (|Re kappa| + |Im kappa|). The bound over all phi is a bound over all theta,
whatever kappa is; a geometric median of the -D_j makes most of the arcs narrow. A window of phi becomes one of
phi' = theta + Im(kappa' (z - c')) for the smaller cell (c', half') by adding -Im(kappa (c' - c)) and widening both ends
by half' (|Re(kappa' - kappa)| + |Im(kappa' - kappa)|), as phi' - phi = Im((kappa' - kappa)(z - c') - kappa (c' - c)).

*Modulus.* |h| = |z - m| / |1 - conj(m) z|, and that quotient carries R to a disc (eq. 20-22) whose nearest and farthest
points from 0 bound |h|. Also log |h| = Re G, G(z) = log(m - z) - log(1 - conj(m) z), so that by the same expansion
log |h| moves by at most a = half (|Re E| + |Im E|) + the two remainders, E = 1 / (m - c) - conj(m) / (1 - conj(m) c);
1 - a <= exp(-a), and exp(a) <= 1 + a + a^2 for a <= 1. The narrower of both is taken.

*Width of a disc.* The circle of radius rho about 0 meets disc(b, e) in an arc of half-angle beta,
sin^2(beta / 2) = (e^2 - (|b| - rho)^2) / (4 rho |b|) (eq. 12). Over rho it grows up to the length of the tangents,
rho^2 = |b|^2 - e^2, where sin beta = e / |b|, and falls from there; if e >= |b| it falls throughout (eq. 30-32).
Where |b| - e <= 2^-16 rounding may decide whether there are tangents. Their length squared, (|b| - e)(|b| + e), is off
by less than 2^-45 then, the length by less than 2^-22: where rho is larger by that, beta falls, and before any angle
is allowed. There e^2 - (|b| - rho)^2 is off by less than 4 e d < 2^-45 e, d as below; more than that is added, as rho
may be much less than e. Discs with |b| < 2^-6, and so e < 2^-6 if there are tangents, are off by less than 2^-49 of
themselves; 2^-16 and 2^-22 become 2^-10 |b| and 2^-16 |b|, where the length squared is off by less than 2^-46 |b|^2.

*Rounding.* u = 2^-53. The centre of a cell and half are exact (dyadic). m - c is rounded once in each component,
conj(m) c and 1 - . three times, so 1 - conj(m) c is off by less than 2^-50. Dividing by F = |1 - conj(m) c|, everything
above is off by less than 2^-46 / F of itself, or of 1 if smaller; arctangents by 2^-49. The slack added to half-widths
and to modulus bounds is 2^-42 / F, sixteen times that; the disc of eq. 20-22, whose denominator
`span` = F^2 - |m|^2 r^2 may cancel, gets 2^-42 (1 + its largest modulus) / span, and is not used for F < 2^-16 or
s2 > 1 - 2^-10, where any rotation and any modulus is allowed. Arc sines of what shrinks with the cell are replaced by
polynomials that exceed them. So a bound holds for what is matched in exact arithmetic, by the discs as they were given:
their centres and radii are off by d < 2^-47 (`mobius.hyperbolic_disc`), which moves |b| -+ e by 2 d, arg b, where an
arc is not the full circle, by less than the slack of its half-width, and e^2 - (|b| - rho)^2 as much as 2 d does if
added to rho: less than the slack of rho, the nearest or farthest modulus.
"""

from __future__ import annotations

import numpy as np

from ..surface.mesh import Complexes, Floats, Integers
from .matching import Matching

SLACK = 2.0**-42

HALF_PI_UP = 1.5707963267948968

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
    rho, b, e = modulus[row, pair], b[pair], matching.radius[pair]
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = np.sqrt((e - (b - rho)) * (e + (b - rho)) / (4 * rho * b))
    half_width = np.where(rho + b <= e, np.pi, 2 * np.arcsin(np.clip(np.nan_to_num(sine), 0, 1)))
    return row, pair, np.angle(matching.centre)[pair] - alpha, half_width


def common_rotation(source: Complexes, centre: Complexes, kappa: Complexes, steps: int = 2) -> Complexes:
    """Return, for each cell centre, (C,), a kappa near the geometric median of -D, by Weiszfeld's iteration."""
    slope = _slopes(source, centre)[0]
    for _ in range(steps):
        weight = 1 / (np.abs(slope + kappa[:, None]) + 0.05)
        kappa = -np.sum(weight * slope, axis=1) / np.sum(weight, axis=1)
    return kappa


def enclosing_arcs(matching: Matching, centre: Complexes, half: Floats, kappa: Complexes) -> Arcs:
    """Return, for each square cell (centre, half), (C,), and each pair, an arc that holds every matching rotation.

    The rotations are phi = theta + Im(kappa (z - centre)): see the module's notes.
    """
    alpha, delta, near, far = images(matching.source, centre, half, kappa)
    inner, outer = (x[matching.target] for x in reaches(matching.centres, matching.radii))
    tangent, wide = (x[matching.target] for x in tangents(matching.centres, matching.radii))
    row, pair = np.nonzero((near[:, matching.point] <= outer) & (far[:, matching.point] >= inner))
    j = matching.point[pair]
    beta = widest_half_angle(
        near[row, j],
        far[row, j],
        np.abs(matching.centre)[pair],
        matching.radius[pair],
        tangent[pair],
        wide[pair],
        delta[row, j] / 32,
    )
    return row, pair, np.angle(matching.centre)[pair] - alpha[row, j], delta[row, j] + beta


def reaches(centre: Complexes, radius: Floats) -> tuple[Floats, Floats]:
    """Return |b| - e and |b| + e of each disc, moved outward."""
    b = np.abs(centre)
    return b - radius - SLACK, b + radius + SLACK


def tangents(centre: Complexes, radius: Floats) -> tuple[Floats, Floats]:
    """Return the length of the tangents to each disc and the half-angle between them, rounded up.

    The length is negative where the disc holds the centre or comes so near to it that rounding would matter: what it is
    at most, 0 without tangents, and 2^-22 or less for the rounding; see the module's notes.
    """
    b, e = np.abs(centre), radius
    small = np.minimum(2.0**6 * b, 1)
    apart = b - e > 2.0**-16 * small
    ratio = np.divide(e, b, out=np.ones_like(b), where=apart)
    length = np.sqrt(np.maximum((b - e) * (b + e), 0))
    length = np.where(apart, length, -np.maximum(length + 2.0**-22 * small, 2.0**-100))
    return length, np.arcsin(ratio) * (1 + 2.0**-48) + SLACK


def images(
    source: Complexes, centre: Complexes, half: Floats, kappa: Complexes
) -> tuple[Floats, Floats, Floats, Floats]:
    """Enclose the image of every source point over square cells, (C,).

    Returns
    -------
    alpha, delta : (C, N1) float64
        Its argument less Im(kappa (z - centre)) lies in alpha +- delta, radians; delta > pi: anywhere.
    near, far : (C, N1) float64
        Bounds of its modulus, in [0, 1].
    """
    c, h, m = centre[:, None], half[:, None], np.abs(source)
    r = h * 1.4142135623730952
    away, facing = source - c, 1 - np.conj(source) * c
    slope, growth = _slopes(source, centre)
    a, f = np.maximum(np.abs(away), 2.0**-100), np.maximum(np.abs(facing), 2.0**-100)
    slack = SLACK / f
    s1, s2 = r / a, m * r / f
    pole = (f < 2.0**-16) | (s2 > 1 - 2.0**-10)
    turns = pole | (s1 > 1 - 2.0**-30)
    s1, s2 = np.where(turns, 0, s1), np.where(turns, 0, s2)
    rest = s1**2 / (2 - 2 * s1) + s2**2 / (2 - 2 * s2)
    linear = h * _taxicab(slope + kappa[:, None]) + rest
    paper = _arcsine(s1) + _arcsine(s2) + h * _taxicab(kappa)[:, None]
    delta = np.where(turns, 2 * np.pi, np.minimum(linear, paper) + slack)
    alpha = np.angle(away * facing)

    span = np.where(pole, 1, f**2 - (m * r) ** 2)
    middle = np.abs(source * r**2 - away * np.conj(facing)) / span
    spread = r * np.maximum(1 - m**2, 0) / span
    off = SLACK * (1 + middle + spread) / span
    near, far = middle - spread - off, middle + spread + off
    growth = h * _taxicab(growth) + rest + slack
    flat = ~turns & (growth < 1)
    at_centre = a / f
    near = np.where(flat, np.maximum(near, at_centre * (1 - growth) - slack), near)
    far = np.where(flat, np.minimum(far, at_centre * (1 + growth + growth**2) + slack), far)
    far = np.minimum(np.maximum(far, near), 1)
    return alpha, delta, np.where(pole, 0, np.maximum(near, 0)), np.where(pole, 1, far)


def widest_half_angle(
    near: Floats, far: Floats, b: Floats, e: Floats, tangent: Floats, wide: Floats, tolerance: Floats
) -> Floats:
    """Return an upper bound of half the angle that a disc covers of circles of radius in [near, far], radians.

    b, e: modulus of its centre, and radius; tangent, wide: see `tangents`; tolerance: by how much the bound may be
    larger than it need be.
    """
    rho = np.where((tangent >= 0) & (far < tangent), far, near)
    rest = np.where(tangent < 0, 2.0**-44 * e, 2.0**-48)
    with np.errstate(divide="ignore"):
        square = ((e - (b - rho)) * (e + (b - rho)) + rest) / (4 * rho * b) * (1 + 2.0**-48)
    sine = np.sqrt(np.clip(square, 0, 1))
    # the polynomial is off by less than s^5 / 2
    beta = 2 * np.where(sine**5 < tolerance, _arcsine(sine), np.arcsin(sine) + SLACK)
    beta = np.where(square < 1, beta, 2 * np.pi)
    beta = np.where((tangent < 0) & (near <= -tangent), 2 * np.pi, beta)
    return np.where((tangent >= near) & (tangent <= far), wide, beta)


def _slopes(source: Complexes, centre: Complexes) -> tuple[Complexes, Complexes]:
    """Return D and E of the module's notes, (C, N1)."""
    away, facing = source - centre[:, None], 1 - np.conj(source) * centre[:, None]
    first = away.conj() / np.maximum(np.abs(away) ** 2, 2.0**-200)
    second = (source * facing).conj() / np.maximum(np.abs(facing) ** 2, 2.0**-200)
    return first + second, first - second


def _taxicab(x: Complexes) -> Floats:
    """Return |Re x| + |Im x|, the largest |Im(x y)| over |Re y|, |Im y| <= 1."""
    return np.asarray(np.abs(x.real) + np.abs(x.imag), dtype=np.float64)


def _arcsine(s: Floats) -> Floats:
    """Return an upper bound of asin(s), 0 <= s <= 1.

    All terms of the series are positive, so that what two terms leave, divided by s^5, is largest at s = 1.
    """
    q = s * s
    return s * (1 + q * (1 / 6 + q * (HALF_PI_UP - 7 / 6))) * (1 + 2.0**-48)
