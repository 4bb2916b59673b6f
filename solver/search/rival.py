"""Is the winner alone? The best transformation that sends the surface's points somewhere else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mobius import Mobius, SphereMobius, hyperbolic_distance
from ..stages import SearchProgress
from ..surface.mesh import Integers
from .branch_and_bound import search
from .matching import Objective, matching

ELSEWHERE = 0.6
"""Pseudo-hyperbolic distance beyond which a point counts as sent elsewhere: half of the disc's radius seen from its
centre is 0.5, what two neighbouring hills are apart is less. Between 0.4 and 0.6 the rivals on faces and teeth are the
same; at 0.6 they are found in half the time."""

LOOKED_AT = 8192
"""Cells that are looked at even if it is decided earlier whether a rival is good enough: a tenth of a second. Then most
searches are over, and the rival and its margin are the best there are; a number of cells, so that they are the same on
every machine."""


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
    matches : (k, 2) int
        As `SearchResult.matches`.
    out_of_time : bool
        Whether the time limit ended the search: only then do its figures depend on the machine.
    """

    mobius: Mobius | SphereMobius
    value: float
    upper_bound: float
    matches: Integers
    out_of_time: bool = False


def best_rival(
    objective: Objective,
    known: Sequence[Mobius],
    *,
    z_max: float,
    enough: float | None = None,
    at_least: int = LOOKED_AT,
    time_limit: float | None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    most_nodes: int | None = None,
) -> Rival | None:
    """Search again without the pairs that known transformations bring near each other; None if cancelled.

    Parameters
    ----------
    objective : Objective
    known : sequence of Mobius
        All reflected, or none: the winner of a search, and rivals found before.
    z_max, time_limit, threads, progress, most_nodes :
        As for `search`.
    enough : float, optional
        The search ends as soon as it is decided whether a rival has this Q, and `at_least` cells have been looked at.
        If that is 0, nothing below it is looked for, which takes less than half the time.
    """
    reflected = known[0].reflected
    seen = np.conj(objective.source) if reflected else objective.source
    elsewhere = np.ones(objective.weights.shape, bool)
    for mobius in known:
        elsewhere &= hyperbolic_distance(mobius(objective.source)[:, None], objective.target) > ELSEWHERE
    found = search(
        seen,
        objective.target,
        objective.radius,
        weights=np.where(elsewhere, objective.weights, 0.0),
        z_max=z_max,
        time_limit=time_limit,
        threads=threads,
        progress=progress,
        enough=enough,
        at_least=at_least,
        most_nodes=most_nodes,
    )
    if found.cancelled:
        return None
    rival = scored(objective, replace(found.mobius, reflected=reflected))
    return replace(rival, upper_bound=max(found.upper_bound, rival.value), out_of_time=found.out_of_time)


def scored(objective: Objective, mobius: Mobius) -> Rival:
    """Return a transformation that comes from elsewhere, with its Q; nothing is claimed of any other."""
    seen = np.conj(objective.source) if mobius.reflected else objective.source
    whole = matching(seen, objective.target, objective.radius, weights=objective.weights)
    plain = replace(mobius, reflected=False)
    return Rival(mobius, whole.value(plain), np.inf, whole.matches(plain))
