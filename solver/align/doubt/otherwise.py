"""A doubtful map made once more with one of the surfaces taken otherwise, and whether it is better then."""

from __future__ import annotations

from ...stages import Part
from ...surface.mesh import Integers, MeshError
from ..maps.dense import bent_densely, drafted_from
from ..maps.mobius_map import challenged, searched
from ..result.alignment import Alignment
from ..result.confidence import DOUBTFUL
from ..surfaces.prepared import Surface
from .decision import sure
from .hypotheses import unlike
from .reconsider import UNLIKE

MOSTLY = 0.6
"""Mean confidence over the whole target, 0 where it has no counterpart, up to which a surface is taken otherwise."""


def doubted(found: Alignment) -> bool:
    """Return whether a map is doubtful, as one also is that leaves much of the target without a counterpart."""
    return found.mean_confidence <= DOUBTFUL or sure(found) <= MOSTLY


def otherwise(
    found: Alignment, source: Surface, target: Surface, clock: Part, landmarks: Integers | None
) -> Alignment | None:
    """Return what comes of surfaces of which one is taken otherwise than in a doubtful map; None if that is no better.

    Its samples have to match better by `AlignSettings.reflect_margin`, its draft must not be too `UNLIKE`, and more of
    its map has to be sure than of the other, once it is bent.
    """
    part = clock.part(0.0, 0.5)
    least = found.search.value / len(found.source_samples) + found.settings.reflect_margin
    try:
        # whether any does at all, of either orientation, takes half the time, and mostly none does
        asked = searched(source, target, found.settings, part, landmarks, least)
        if max(asked.search.value, asked.other.value if asked.other else 0.0) <= least * len(asked.source_samples):
            return None
        matched = searched(source, target, found.settings, part, landmarks)
    except MeshError:
        return None
    if matched.search.value <= least * len(matched.source_samples):
        return None
    matched = challenged(matched, part)
    part = clock.part(0.5, 1.0)
    first = drafted_from(matched, part)
    if unlike(matched, first[0], first[2]) > UNLIKE:
        return None
    other = bent_densely(matched, first, part, landmarks)
    return other if sure(other) > max(DOUBTFUL, sure(found)) else None
