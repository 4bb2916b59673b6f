"""Complex numbers in rational arithmetic, for `certificate`; `rim` has its own, so that one can check the other."""

from __future__ import annotations

from fractions import Fraction
from math import isqrt

BITS = 160
"""Of the fixed-point numbers that stand for exp(i theta)."""

Exact = tuple[Fraction, Fraction]
"""Real and imaginary part."""


def exactly(x: complex) -> Exact:
    """Return a number as it is."""
    return Fraction(float(x.real)), Fraction(float(x.imag))


def square(x: Exact) -> Fraction:
    """Return |x|^2."""
    return x[0] * x[0] + x[1] * x[1]


def times(x: Exact, y: Exact) -> Exact:
    """Return the product."""
    return x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]


def sides(m: Exact, b: Exact, z: Exact, u: Exact, hyperbolic: bool) -> tuple[Fraction, Fraction]:
    """Return |A|^2 and |B|^2 of the notes of `certificate`."""
    moved = times(u, (m[0] - z[0], m[1] - z[1]))
    product = times((z[0], -z[1]), m)
    facing = 1 - product[0], -product[1]
    carried = times(b, facing)
    a = moved[0] - carried[0], moved[1] - carried[1]
    if not hyperbolic:
        return square(a), square(facing)
    back = times((b[0], -b[1]), moved)
    return square(a), square((facing[0] - back[0], facing[1] - back[1]))


def root_up(x: Fraction) -> Fraction:
    """Return an upper bound of the square root, off by less than 2^-60."""
    return Fraction(isqrt((x.numerator << 120) // x.denominator) + 1, 1 << 60)


def turn(theta: float | Fraction) -> tuple[Exact, Fraction]:
    """Return exp(i theta) in rational numbers, and by how much it may be off."""
    x = Fraction(theta)
    if x == 0:
        return (Fraction(1), Fraction(0)), Fraction(0)
    # exp(i theta) = exp(i theta / 2^k)^(2^k): an angle below 1, k squarings, and k + 64 bits that these may spoil
    k = max(int(abs(x)).bit_length(), 0)
    one = 1 << (BITS + 2 * k + 64)
    angle = x.numerator * one // (x.denominator << k)
    real, imag, term_real, term_imag, n = one, 0, one, 0, 0
    while max(abs(term_real), abs(term_imag)) > 1:
        n += 1
        term_real, term_imag = -term_imag * angle // (n * one), term_real * angle // (n * one)
        real, imag = real + term_real, imag + term_imag
    for _ in range(k):
        real, imag = (real * real - imag * imag) // one, 2 * real * imag // one
    # the series is off by less than 8 (n + 2) units, as |angle| < 1; a squaring doubles that and rounds by 2 more
    off = Fraction((8 * (n + 2) + 4) << 2 * k, one)
    return (Fraction(real, one), Fraction(imag, one)), off
