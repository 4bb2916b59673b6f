"""Is the winner alone? The best transformation that sends the surface's points somewhere else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .matching import matching
from .mesh import Complexes, Floats
from .mobius import Mobius, hyperbolic_distance
from .search import SearchProgress, SearchResult, search

ELSEWHERE = 0.6
"""Pseudo-hyperbolic distance beyond which a point counts as sent elsewhere: half of the disc's radius seen from its
centre is 0.5, what two neighbouring hills are apart is less. Between 0.4 and 0.6 the rivals on faces and teeth are the
same; at 0.6 they are found in half the time."""


@dataclass(frozen=True)
class Rival:
    """The best transformation found far from the winner.

    Attributes
    ----------
    mobius : Mobius
    value : float
        Its Q, on the same scale as the winner's.
    upper_bound : float
        No transformation that sends every point elsewhere has a larger Q.
    """

    mobius: Mobius
    value: float
    upper_bound: float


def best_rival(
    source: Complexes,
    target: Complexes,
    radius: Floats | float,
    weights: Floats,
    winner: SearchResult,
    *,
    z_max: float,
    close: float,
    time_limit: float | None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
) -> Rival | None:
    """Search again without the pairs that the winner brings near each other; None if cancelled.

    The search ends as soon as it is decided whether a rival is as good as the winner to within `close`.

    Parameters
    ----------
    source, target, radius, weights, z_max, time_limit, progress :
        As for `search`, of the search that `winner` came from; `winner.mobius` may be reflected.
    close : float
        Difference of Q below which the two are not told apart.
    """
    reflected = winner.mobius.reflected
    seen = np.conj(source) if reflected else source
    elsewhere = hyperbolic_distance(winner.mobius(source)[:, None], target) > ELSEWHERE
    stopped = False

    def decided(state: SearchProgress) -> bool | None:
        nonlocal stopped
        stopped = progress is not None and progress(state) is False
        enough = winner.value - close
        return False if stopped or state.upper_bound < enough or state.value >= enough else None

    found = search(
        seen,
        target,
        radius,
        weights=np.where(elsewhere, weights, 0.0),
        z_max=z_max,
        time_limit=time_limit,
        progress=decided,
    )
    if stopped:
        return None
    value = matching(seen, target, radius, weights=weights).value(found.mobius)
    return Rival(replace(found.mobius, reflected=reflected), value, max(found.upper_bound, value))
