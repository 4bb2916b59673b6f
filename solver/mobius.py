"""The automorphisms of the unit disc and the hyperbolic discs that they carry into each other."""

from __future__ import annotations

import cmath
from dataclasses import dataclass

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


def conformal_barycentre(points: Complexes, weights: Floats, tolerance: float = 1e-12) -> complex:
    """Return the z for which the weighted mean of `Mobius(z, 0)(points)` is 0.

    Any `Mobius` carries the barycentre of points to that of their images, so it centres a disc in the one way that is
    free of pose (Douady and Earle 1986). It exists unless half of the weight sits in one point of the unit circle.

    Parameters
    ----------
    points : (n,) complex128
        |points| <= 1.
    weights : (n,) float64
        Non-negative, with a positive sum.
    tolerance : float
        The mean is taken as 0 below this.
    """
    weights = weights / weights.sum()
    centring = Mobius()
    moved = points
    mean = complex(np.sum(weights * moved))
    for _ in range(200):
        if abs(mean) < tolerance:
            break
        # Newton's step for the mean of (x - z)/(1 - x conj(z)) at z = 0: 0 = mean - z + conj(z) square
        square = complex(np.sum(weights * moved**2))
        step = (mean + square * mean.conjugate()) / max(1 - abs(square) ** 2, 1e-12)
        length = abs(step)
        step *= min(1.0, 0.7 / length)
        while True:  # shorten until the mean falls, so that points near the circle cannot throw it about
            trial = Mobius(step, 0.0) @ centring
            moved_trial = trial(points)
            mean_trial = complex(np.sum(weights * moved_trial))
            if abs(mean_trial) < abs(mean) or abs(step) < 1e-15:
                break
            step *= 0.5
        if abs(step) < 1e-15:
            break
        centring, moved, mean = trial, moved_trial, mean_trial
    return centring.z
