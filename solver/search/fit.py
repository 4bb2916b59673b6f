"""Least squares for a Möbius transformation: parameters, their derivatives, the fit to given correspondences."""

from __future__ import annotations

import cmath
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from ..mobius import Mobius
from ..surface.mesh import Complexes, Floats


def parameters(mobius: Mobius, z_max: float) -> Floats:
    """Return three unbounded numbers that stand for a plain transformation with |z| < z_max (else its nearest such)."""
    q = mobius.z / z_max
    q *= min(1.0, (1 - 1e-9) / max(abs(q), 1e-300))
    q /= cmath.sqrt(1 - abs(q) ** 2).real
    return np.array([q.real, q.imag, mobius.theta])


def transformation(parameter: Floats, z_max: float) -> Mobius:
    """Return the transformation that `parameters` stand for."""
    q = complex(parameter[0], parameter[1])
    return Mobius(z_max * q / np.sqrt(1 + abs(q) ** 2), float(parameter[2]))


def images(x: Complexes, parameter: Floats, z_max: float) -> tuple[Complexes, Complexes]:
    """Return the images of points x, (n,), and their derivatives by the three parameters, (n, 3)."""
    f = transformation(parameter, z_max)
    z, turn = f.z, cmath.exp(1j * f.theta)
    below = 1 - x * z.conjugate()
    image = turn * (x - z) / below
    by_z, by_conj_z = -turn / below, image * x / below
    q = complex(parameter[0], parameter[1])
    length = np.sqrt(1 + abs(q) ** 2)
    derivative = np.empty((len(x), 3), np.complex128)
    for k, step in enumerate((1, 1j)):
        dz = z_max * (step - q * (q * np.conj(step)).real / length**2) / length
        derivative[:, k] = by_z * dz + by_conj_z * np.conj(dz)
    derivative[:, 2] = 1j * image
    return image, derivative


def residuals(image: Complexes, target: Complexes, metric: str) -> tuple[Complexes, Complexes]:
    """Return complex numbers whose modulus is the distance in the metric, and their derivatives by the images.

    Hyperbolic: (x - b) / (1 - conj(b) x). Shapes are broadcast.
    """
    if metric == "euclidean":
        return image - target, np.ones(np.broadcast(image, target).shape, np.complex128)
    below = 1 - np.conj(target) * image
    return (image - target) / below, (1 - np.abs(target) ** 2) / below**2


def fitted(
    source: Complexes,
    target: Complexes,
    weights: Floats,
    start: Mobius,
    *,
    metric: str,
    z_max: float,
    loss: str = "linear",
    scale: float = 1.0,
) -> Mobius:
    """Return the plain transformation near `start` that brings source points, (n,), closest to those of the target.

    Parameters
    ----------
    source, target : (n,) complex128
    weights : (n,) float64
        Of the squared distances, >= 0.
    start : Mobius
        Not reflected.
    metric : str
    z_max : float
        Bound on |z|.
    loss, scale : str, float
        `loss` and `f_scale` of `scipy.optimize.least_squares`.
    """
    root = np.sqrt(weights)

    def both(parameter: Floats) -> tuple[Complexes, Complexes]:
        image, by_parameter = images(source, parameter, z_max)
        residual, by_image = residuals(image, target, metric)
        return root * residual, (root * by_image)[:, None] * by_parameter

    def value(parameter: Floats) -> Floats:
        residual = both(parameter)[0]
        return np.concatenate([residual.real, residual.imag])

    def jacobian(parameter: Floats) -> Floats:
        derivative = both(parameter)[1]
        return np.concatenate([derivative.real, derivative.imag])

    found = least_squares(
        value,
        parameters(start, z_max),
        jac=cast("str", jacobian),  # scipy's own annotation leaves functions out
        loss=loss,
        f_scale=scale,
        max_nfev=100,
    )
    return transformation(found.x, z_max)


def algebraic_fit(source: Complexes, target: Complexes, weights: Floats) -> Mobius:
    """Return a plain transformation that nearly carries source points, (n,), to those of the target; no start needed.

    f(x) = (a x + b) / (conj(b) x + conj(a)) = y is linear in a and b over the real numbers: the least singular vector
    of y (conj(b) x + conj(a)) - (a x + b) = 0. The identity where that is no automorphism of the disc.
    """
    x, y = source, target
    rows = np.stack([y - x, -1j * (y + x), x * y - 1, -1j * (x * y + 1)], axis=1) * np.sqrt(weights)[:, None]
    # the triangular factor has the same singular vectors, and four rows
    _, _, basis = np.linalg.svd(np.linalg.qr(np.concatenate([rows.real, rows.imag]), mode="r"), full_matrices=True)
    a, b = complex(basis[-1, 0], basis[-1, 1]), complex(basis[-1, 2], basis[-1, 3])
    if abs(b) >= abs(a):
        return Mobius()
    return Mobius(-b / a, 2 * cmath.phase(a))
