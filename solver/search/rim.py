"""Points next to the rim of their match disc: whether they are in it, decided in integers.

The pair (m, b) is matched by exp(i theta) = u and z if |A| <= tau |B|, where, without a division,

    hyperbolic:  A = u (m - z) - b (1 - conj(z) m),   B = (1 - conj(z) m) - conj(b) u (m - z)
    Euclidean:   the same A,                          B = 1 - conj(z) m

Every number given is a whole multiple of a power of 2, and so are the sides once u is one. u is known to within 2^-140,
which moves tau^2 |B|^2 - |A|^2 by less than 64 times that, as |A|, |B| <= 4; for theta = 0 it is 1.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..mobius import Mobius
from ..surface.mesh import Complexes, Floats

BITS = 192
"""Of the numbers that stand for u, after the point."""

OFF = 1 << BITS - 140
"""By how much they may be off, in the last place."""

_Whole = tuple[int, int]
"""Real and imaginary part."""


def surely_within(
    mobius: Mobius, m: Complexes, b: Complexes, tau: Floats, *, hyperbolic: bool
) -> npt.NDArray[np.bool_]:
    """Return for which pairs, (n,), |f(m) - b| <= tau |1 - conj(b) f(m)| (Euclidean: <= tau) for certain.

    What is not certain is as if no such pair existed: the two sides are alike in 100 digits after the point.
    """
    numbers = np.concatenate([[mobius.z], m, b, tau])
    ratios = [x.as_integer_ratio() for z in numbers.tolist() for x in (z.real, z.imag)]
    # denominators are powers of 2
    shift = max(d.bit_length() for _, d in ratios) - 1
    scaled = [n << shift - (d.bit_length() - 1) for n, d in ratios]
    z, *rest = zip(scaled[::2], scaled[1::2], strict=True)
    count = len(m)
    u, off = exponential(mobius.theta)
    found = [
        _within(z, (x[0], -x[1]) if mobius.reflected else x, y, radius, u, off, shift, hyperbolic)
        for x, y, (radius, _) in zip(rest[:count], rest[count : 2 * count], rest[2 * count :], strict=True)
    ]
    return np.array(found, dtype=bool)


def _within(z: _Whole, m: _Whole, b: _Whole, tau: int, u: _Whole, off: int, shift: int, hyperbolic: bool) -> bool:
    """Return whether |A| <= tau |B| for certain; z, m, b and tau are multiples of 2^-shift, u of 2^-BITS."""
    moved = _times(u, (m[0] - z[0], m[1] - z[1]))  # of 2^-(BITS + shift)
    product = _times((z[0], -z[1]), m)
    facing = (1 << 2 * shift) - product[0], -product[1]  # of 2^-(2 shift)
    carried = _times(b, facing)
    # all that follows of 2^-(BITS + 3 shift)
    a = (moved[0] << 2 * shift) - (carried[0] << BITS), (moved[1] << 2 * shift) - (carried[1] << BITS)
    f = facing[0] << BITS + shift, facing[1] << BITS + shift
    if hyperbolic:
        back = _times((b[0], -b[1]), moved)
        f = f[0] - (back[0] << shift), f[1] - (back[1] << shift)
    room = tau * tau * (f[0] * f[0] + f[1] * f[1]) - ((a[0] * a[0] + a[1] * a[1]) << 2 * shift)
    # of 2^-(2 BITS + 8 shift)
    return room > 64 * off << BITS + 8 * shift if off else room >= 0


def exponential(theta: float) -> tuple[_Whole, int]:
    """Return exp(i theta) in multiples of 2^-BITS, and by how many it may be off.

    By the series for an angle of at most 1, that theta is a power of 2 times; then by squaring, which doubles what the
    number is off by. All that is left of a number of 64 + `halvings` bits more is far below `OFF`.
    """
    if theta == 0:
        return (1 << BITS, 0), 0
    halvings = max(math.frexp(theta)[1], 0)
    bits = BITS + 64 + 2 * halvings
    n, d = theta.as_integer_ratio()
    angle = (n << bits) // (d << halvings)
    real, imag, term = 1 << bits, 0, (1 << bits, 0)
    k = 0
    while any(term) and k < 2 * bits:
        k += 1
        term = -term[1] * angle // (k << bits), term[0] * angle // (k << bits)
        if max(abs(term[0]), abs(term[1])) <= 1:
            break
        real, imag = real + term[0], imag + term[1]
    for _ in range(halvings):
        real, imag = (real * real - imag * imag) >> bits, 2 * real * imag >> bits
    return (real >> bits - BITS, imag >> bits - BITS), OFF


def _times(x: _Whole, y: _Whole) -> _Whole:
    return x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]
