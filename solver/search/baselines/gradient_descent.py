"""Gradient descent on a smooth surrogate of the objective, from coarse to fine.

Koehl and Hass, "Automatic alignment of genus-zero surfaces" (2014), descend over the Möbius group; their energy, the
distortion of a map between whole surfaces, is replaced by one of point sets.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from ...mobius import Mobius
from ...stages import SearchProgress
from ...surface.mesh import Complexes, Floats
from ..fit import images, parameters, residuals, transformation
from ..outcome import SearchResult
from .incumbent import Incumbent, incumbent


def gradient_descent(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
    z_max: float = 0.95,
    reflect: bool = False,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    starts: int = 8,
    coarsest: float = 16.0,
) -> SearchResult:
    """Return the best of the maxima to which a smoothed objective rises from rotations about the centre.

    Parameters
    ----------
    source, target, radius, metric, weights, z_max, reflect, time_limit, threads, progress
        As in `search`; one thread is used.
    starts : int
        Descents, from z = 0 and as many equally spaced rotations.
    coarsest : float
        How many times wider than the match discs the first smoothing is; it is halved down to the discs themselves.

    Returns
    -------
    SearchResult
        Not certified; `nodes` counts evaluations of the smoothed objective.

    Notes
    -----
    With g_jk = w_jk exp(-d(f(m_j), b_k)^2 / (2 s^2 r_k^2)), r_k being the radius of the match disc and s the
    smoothing, what rises is sum_j (1 - prod_k (1 - g_jk)): the smooth "some b_k is near", at most 1 for each j.
    """
    best = incumbent(
        source, target, radius, metric=metric, weights=weights, z_max=z_max, reflect=reflect, time_limit=time_limit,
        threads=threads, progress=progress,
    )  # fmt: skip
    r = np.broadcast_to(np.asarray(radius, dtype=np.float64), best.target.shape)
    scales = [coarsest * 0.5**k for k in range(int(np.log2(max(coarsest, 1))) + 1)]
    for reflected in best.sides:
        points = best.source(reflected)
        for k in range(starts):
            parameter = parameters(Mobius(0, 2 * np.pi * k / starts), z_max)
            for scale in scales:
                if not best.goes_on():
                    return best.result()
                found = minimize(
                    _unmatched, parameter, (best, points, np.minimum(scale * r, 1.0)), method="BFGS", jac=True
                )  # fmt: skip
                parameter = found.x
                best.nodes += int(found.nfev)
            best.offer(transformation(parameter, z_max), reflected)
    return best.result()


def _unmatched(parameter: Floats, best: Incumbent, points: Complexes, width: Floats) -> tuple[float, Floats]:
    """Return the smoothed count of source points without a partner, and its gradient by the three parameters."""
    image, by_parameter = images(points, parameter, best.z_max)
    residual, by_image = residuals(image[:, None], best.target, best.metric)
    near = best.weights * np.exp(-0.5 * (np.abs(residual) / width) ** 2)
    near = np.minimum(near, 1 - 1e-12)  # where a distance vanishes its derivative does, too
    none_near = np.exp(np.log1p(-near).sum(axis=1))
    # d |residual|^2 / 2 = Re(conj(residual) by_image d image)
    pull = (none_near[:, None] * near / (1 - near) / width**2 * np.conj(residual) * by_image).sum(axis=1)
    return float(none_near.sum()), np.real(pull @ by_parameter)
