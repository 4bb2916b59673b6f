"""Is the winner alone, on the sphere? The best rotation that sends the surface's points somewhere else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..mobius import SphereMobius
from ..stages import SearchProgress
from .matching import Objective
from .rival import Rival
from .sphere_matching import sphere_matching
from .sphere_search import sphere_search

ELSEWHERE = 0.6
"""Chord beyond which a point counts as sent elsewhere, some 35 degrees, as in the disc: what two neighbouring hills
are apart is less."""


def best_sphere_rival(
    objective: Objective,
    known: Sequence[SphereMobius],
    *,
    time_limit: float | None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
) -> Rival | None:
    """Search the rotations again without the pairs that known transformations bring near each other; None if cancelled.

    The arguments are those of `best_rival`. `upper_bound` is about rotations.
    """
    reflected = known[0].reflected
    seen = objective.source * [1.0, -1.0, 1.0] if reflected else objective.source
    elsewhere = np.ones(objective.weights.shape, bool)
    for mobius in known:
        apart = np.linalg.norm(mobius(objective.source)[:, None] - objective.target, axis=2)
        elsewhere &= apart > ELSEWHERE
    found = sphere_search(
        seen,
        objective.target,
        objective.radius,
        weights=np.where(elsewhere, objective.weights, 0.0),
        h_max=0,
        time_limit=time_limit,
        progress=progress,
    )
    if found.cancelled:
        return None
    rival = scored_on_sphere(objective, replace(found.mobius, reflected=reflected))
    return replace(rival, upper_bound=max(found.upper_bound, rival.value), out_of_time=found.out_of_time)


def scored_on_sphere(objective: Objective, mobius: SphereMobius) -> Rival:
    """Return a transformation that comes from elsewhere, with its Q; nothing is claimed of any other."""
    seen = objective.source * [1.0, -1.0, 1.0] if mobius.reflected else objective.source
    whole = sphere_matching(seen, objective.target, objective.radius, weights=objective.weights)
    value, matches = whole.evaluated(replace(mobius, reflected=False))
    return Rival(mobius, value, np.inf, matches)
