"""The automorphisms of the unit disc and of the sphere; the hyperbolic discs that the former carry into each other."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .surface.mesh import Complexes, Floats


@dataclass(frozen=True)
class Mobius:
    """A conformal (or, reflected, anticonformal) automorphism of the unit disc.

    f(x) = exp(i theta) (x - z) / (1 - x conj(z)), Le, Chin and Suter (2016), eq. 1; a reflected one is f(conj(x)).

    Parameters
    ----------
    z : complex
        The point that goes to the centre (its conjugate, if reflected), |z| < 1.
    theta : float
        Rotation in radians.
    reflected : bool
        Whether x is conjugated first.

    Raises
    ------
    ValueError
        |z| >= 1, or a parameter that is not finite.

    Examples
    --------
    >>> f = Mobius(0.5, 0.3)
    >>> abs(f.inverse()(f(0.2j)) - 0.2j) < 1e-15
    True
    """

    z: complex = 0j
    theta: float = 0.0
    reflected: bool = False

    def __post_init__(self) -> None:
        z, theta = complex(self.z), float(self.theta)
        if not (cmath.isfinite(z) and cmath.isfinite(theta) and abs(z) < 1):
            raise ValueError(
                f"a Möbius transformation of the disc needs |z| < 1 and a finite angle, not z={z}, theta={theta}"
            )
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "theta", theta)

    def __call__(self, x: npt.ArrayLike) -> Complexes:
        """Return the images of the points x (any shape, |x| <= 1)."""
        x = np.asarray(x, dtype=np.complex128)
        if self.reflected:
            x = np.conj(x)
        with np.errstate(invalid="ignore"):  # nan (a vertex in no face) stays nan
            return np.exp(1j * self.theta) * (x - self.z) / (1 - x * np.conj(self.z))

    def conjugate(self) -> Mobius:
        """Return x -> conj(f(conj(x))), with the same `reflected`."""
        return Mobius(self.z.conjugate(), -self.theta, self.reflected)

    def inverse(self) -> Mobius:
        """Return the transformation that undoes this one."""
        back = Mobius(-cmath.exp(1j * self.theta) * self.z, -self.theta)
        return Mobius(back.z.conjugate(), -back.theta, True) if self.reflected else back

    def __matmul__(self, first: Mobius) -> Mobius:
        """Return the composition: (a @ b)(x) = a(b(x))."""
        inner = first.conjugate() if self.reflected else first
        # as matrices [[a, b], [conj(b), conj(a)]]
        a1, a2 = cmath.exp(0.5j * self.theta), cmath.exp(0.5j * inner.theta)
        b1, b2 = -a1 * self.z, -a2 * inner.z
        a = a1 * a2 + b1 * b2.conjugate()
        b = a1 * b2 + b1 * a2.conjugate()
        return Mobius(-b / a, 2 * cmath.phase(a), self.reflected != first.reflected)

    def derivative(self, x: npt.ArrayLike) -> Floats:
        """Return |f'(x)|, the factor by which lengths grow at x (conj(x), if reflected)."""
        x = np.asarray(x, dtype=np.complex128)
        if self.reflected:
            x = np.conj(x)
        return (1 - abs(self.z) ** 2) / np.abs(1 - x * np.conj(self.z)) ** 2


@dataclass(frozen=True)
class SphereMobius:
    """A conformal (or, reflected, anticonformal) automorphism of the unit sphere: an element of PSL(2, C).

    f(x) = R T_h(x), T_h(x) = (1 - |h|^2) (x - h) / |x - h|^2 - h; a reflected one is f((x, -y, z)). T_h carries h to
    the centre of the ball and moves points of the sphere away from h. As 2 x 2 matrices acting on I + x.sigma, sigma
    Pauli's matrices, T_h is I - h.sigma up to scale, and R the quaternion's matrix.

    Parameters
    ----------
    h : (float, float, float)
        A point of the open unit ball.
    rotation : (float, float, float, float)
        R as a quaternion (w, x, y, z) other than 0; its length does not matter: R x = q x conj(q) / |q|^2, exactly.
    reflected : bool
        Whether the sign of y is changed first.

    Raises
    ------
    ValueError
        |h| >= 1, the quaternion 0, or a parameter that is not finite.

    Examples
    --------
    >>> f = SphereMobius((0.1, 0.2, 0.0), (1.0, 0.0, 0.5, 0.0))
    >>> bool(np.abs(f.inverse()(f([[0.0, 0.6, 0.8]])) - [[0.0, 0.6, 0.8]]).max() < 1e-15)
    True
    """

    h: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    reflected: bool = False

    def __post_init__(self) -> None:
        h, q = tuple(float(a) for a in self.h), tuple(float(a) for a in self.rotation)
        fits = len(h) == 3 and len(q) == 4 and all(math.isfinite(a) for a in (*h, *q))
        if not (fits and math.hypot(*h) < 1 and 1e-100 < math.hypot(*q) < math.inf):
            raise ValueError(
                f"a Möbius transformation of the sphere needs |h| < 1 and a quaternion other than 0, not h={self.h}, "
                f"rotation={self.rotation}"
            )
        object.__setattr__(self, "h", h)
        object.__setattr__(self, "rotation", q)

    def __call__(self, x: npt.ArrayLike) -> Floats:
        """Return the images of points of the sphere, (..., 3)."""
        x = np.asarray(x, dtype=np.float64)
        if self.reflected:
            x = x * [1.0, -1.0, 1.0]
        h = np.array(self.h)
        away = x - h
        with np.errstate(invalid="ignore"):  # nan (a vertex in no face) stays nan
            moved = away * ((1 - h @ h) / (away**2).sum(axis=-1, keepdims=True)) - h
        return moved @ self.matrix.T

    @property
    def matrix(self) -> Floats:
        """R, (3, 3)."""
        w, x, y, z = np.array(self.rotation) / math.hypot(*self.rotation)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def conjugate(self) -> SphereMobius:
        """Return c f c, c the change of the sign of y, with the same `reflected`."""
        (x, y, z), (w, a, b, c) = self.h, self.rotation
        return SphereMobius((x, -y, z), (w, -a, b, -c), self.reflected)

    def inverse(self) -> SphereMobius:
        """Return the transformation that undoes this one."""
        x, y, z = (-self.matrix @ np.array(self.h)).tolist()
        w, a, b, c = self.rotation
        back = SphereMobius((x, y, z), (w, -a, -b, -c))
        return SphereMobius(*_parts(back.conjugate()), True) if self.reflected else back

    def __matmul__(self, first: SphereMobius) -> SphereMobius:
        """Return the composition: (a @ b)(x) = a(b(x))."""
        inner = first.conjugate() if self.reflected else first
        return from_spinor_matrix(spinor_matrix(self) @ spinor_matrix(inner), self.reflected != first.reflected)

    def derivative(self, x: npt.ArrayLike) -> Floats:
        """Return the factor by which lengths grow at points x, (..., 3)."""
        x = np.asarray(x, dtype=np.float64)
        if self.reflected:
            x = x * [1.0, -1.0, 1.0]
        h = np.array(self.h)
        return (1 - h @ h) / ((x - h) ** 2).sum(axis=-1)


def as_plain(mobius: Mobius | SphereMobius) -> dict[str, Any]:
    """Return a transformation as JSON-ready data."""
    if isinstance(mobius, SphereMobius):
        return {"h": list(mobius.h), "rotation": list(mobius.rotation), "reflected": mobius.reflected}
    return {"z": [mobius.z.real, mobius.z.imag], "theta": mobius.theta, "reflected": mobius.reflected}


def from_plain(data: Mapping[str, Any]) -> Mobius | SphereMobius:
    """Return the transformation that `as_plain` gave the data of.

    >>> from_plain(as_plain(Mobius(0.5, 0.3, True)))
    Mobius(z=(0.5+0j), theta=0.3, reflected=True)
    """
    if "h" in data:
        return SphereMobius(tuple(data["h"]), tuple(data["rotation"]), data["reflected"])
    return Mobius(complex(*data["z"]), data["theta"], data["reflected"])


def _parts(mobius: SphereMobius) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    return mobius.h, mobius.rotation


def spinors(x: npt.ArrayLike) -> Complexes:
    """Return the unit vectors psi of C^2, (n, 2), that points of the sphere stand for: psi psi' = (I + x.sigma) / 2."""
    a, b, c = np.asarray(x, dtype=np.float64).T
    large = np.sqrt((1 + np.abs(c)) / 2)
    small = 1 / (2 * large)
    up = c >= 0
    first = np.where(up, large, (a - 1j * b) * small)
    return np.stack([first, np.where(up, (a + 1j * b) * small, large)], axis=1)


def spinor_matrix(mobius: SphereMobius) -> Complexes:
    """Return R T_h as a matrix, (2, 2), up to scale."""
    (x, y, z), (w, a, b, c) = mobius.h, mobius.rotation
    turn = np.array([[w - 1j * c, -b - 1j * a], [b - 1j * a, w + 1j * c]]) / math.hypot(*mobius.rotation)
    return turn @ np.array([[1 - z, -x + 1j * y], [-x - 1j * y, 1 + z]], np.complex128)


def from_spinor_matrix(a: Complexes, reflected: bool = False) -> SphereMobius:
    """Return what a matrix, (2, 2), stands for: its polar decomposition into a rotation and I - h.sigma."""
    square = np.conj(a.T) @ a  # (1 + |h|^2) I - 2 h.sigma, up to scale
    half = float(square[0, 0].real + square[1, 1].real)
    x, y, z = 2 * float(square[0, 1].real), -2 * float(square[0, 1].imag), float((square[0, 0] - square[1, 1]).real)
    under = half + math.sqrt(max(half * half - x * x - y * y - z * z, 0.0))
    most = 1 - 2.0**-50  # which rounding may exceed
    under = max(under, math.hypot(x, y, z) / most)
    h = (-x / under, -y / under, -z / under)
    back = np.array([[1 + h[2], h[0] - 1j * h[1]], [h[0] + 1j * h[1], 1 - h[2]]])  # the inverse, up to scale
    turn = a @ back
    root = np.sqrt(turn[0, 0] * turn[1, 1] - turn[0, 1] * turn[1, 0])
    turn = turn / root
    q = (float(turn[0, 0].real), -float(turn[0, 1].imag), float(turn[1, 0].real), -float(turn[0, 0].imag))
    return SphereMobius(h, q, reflected)


def hyperbolic_distance(x: npt.ArrayLike, y: npt.ArrayLike) -> Floats:
    """Return the pseudo-hyperbolic distance |x - y| / |1 - conj(y) x| in [0, 1], which every `Mobius` preserves.

    The length in the Poincaré metric of curvature -1 is 2 artanh of it.

    >>> float(hyperbolic_distance(0.5, 0.0))
    0.5
    """
    x, y = np.asarray(x, np.complex128), np.asarray(y, np.complex128)
    return np.abs(x - y) / np.abs(1 - np.conj(y) * x)


def hyperbolic_disc(centre: npt.ArrayLike, tau: npt.ArrayLike) -> tuple[Complexes, Floats]:
    """Return Euclidean centres and radii of the discs {x : hyperbolic_distance(x, centre) <= tau}, 0 < tau < 1.

    Both are off by less than 2^-47, whatever cancels; not so the radius over 1 - |centre| next to the unit circle.
    """
    b, tau = np.asarray(centre, np.complex128), np.asarray(tau, np.float64)
    inward, narrowing, scale = 1 - np.abs(b) ** 2, 1 - tau**2, 1 / (1 - tau**2 * np.abs(b) ** 2)
    if (wide := scale > 8).any():
        # there both differences are taken to their last digits, and 1 - tau^2 |b|^2 is their sum
        inward = np.where(wide, one_less_square(b), inward)
        narrowing = np.where(wide, (1 - tau) * (1 + tau), narrowing)
        scale = np.where(wide, 1 / (narrowing + tau**2 * inward), scale)
    return b * narrowing * scale, tau * inward * scale


def one_less_square(x: Complexes) -> Floats:
    """Return 1 - |x|^2 to its last digits, where floats alone lose some to cancellation; |x| <= 1."""
    parts = np.stack([x.real, x.imag])
    square = parts * parts
    # Dekker's product: halves of 26 digits multiply without rounding
    high = parts * 134217729.0
    high = high - (high - parts)
    low = parts - high
    rest = ((high * high - square) + 2 * high * low) + low * low
    large, small = np.maximum(*square), np.minimum(*square)
    apart = 1 - large  # exact from 1/2 on, as |x| near 1 makes it
    total = apart - small
    shift = total - apart
    return total + (((apart - (total - shift)) + (-small - shift)) - rest.sum(axis=0))
