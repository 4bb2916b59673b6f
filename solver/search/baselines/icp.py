"""Iterative closest points, with a Möbius transformation in the place of the rigid motion.

Besl and McKay, "A method for registration of 3-D shapes" (1992), as Le, Chin and Suter (2016) modify it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...mobius import Mobius
from ...stages import SearchProgress
from ..fit import fitted
from ..measures import distances
from ..outcome import SearchResult
from .incumbent import incumbent


def icp(
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
    start: Mobius | None = None,
    iterations: int = 200,
) -> SearchResult:
    """Return where closest points and least squares in (z, theta), in turn, come to rest.

    Parameters
    ----------
    source, target, radius, metric, weights, z_max, reflect, time_limit, threads, progress
        As in `search`; one thread is used. Distances are those of the metric; only compatible points are closest.
    start : Mobius, optional
        Where to begin, not reflected; with `reflect` on the conjugated source as well. Default: the identity.
    iterations : int
        At most this many rounds; fewer if the closest points stay the same.

    Returns
    -------
    SearchResult
        Not certified; `nodes` counts rounds.
    """
    best = incumbent(
        source, target, radius, metric=metric, weights=weights, z_max=z_max, reflect=reflect, time_limit=time_limit,
        threads=threads, progress=progress,
    )  # fmt: skip
    matchable = np.flatnonzero(best.weights.any(axis=1))
    compatible = best.weights[matchable] > 0
    for reflected in best.sides:
        points = best.source(reflected)[matchable]
        mobius, closest = start or Mobius(), None
        for _ in range(iterations if len(points) else 0):
            if not best.goes_on():
                break
            table = np.where(compatible, distances(mobius(points), best.target, metric), np.inf)
            before, closest = closest, table.argmin(axis=1)
            if before is not None and (before == closest).all():
                break
            best.nodes += 1
            mobius = fitted(
                points, best.target[closest], best.weights[matchable, closest], mobius, metric=metric, z_max=z_max
            )
        best.offer(mobius, reflected)
    return best.result()
