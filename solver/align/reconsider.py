"""Which of several maps is taken: another of the search's maxima, where the best is doubtful or needlessly mirrored."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..bend.bend import Draft
from ..stages import Part
from ..surface.mesh import Booleans
from .agreement import descriptor_distance
from .alignment import Alignment
from .dense import bent_densely, drafted_from
from .mobius_map import rival_of, taking, unproved

DOUBTFUL = 0.5
"""Mean confidence up to which the whole map is doubted aloud."""

FITS = 0.75
"""Mean confidence from which on another map than the search's best is taken.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.72 or more, the wrong ones that were not
mirrored 0.31 or less; a sheet, not mirrored where mirrored is right, 0.55.
"""

HYPOTHESES = 3
"""Maxima of the search that are bent, at most, in place of a map that is doubtful, or mirrored."""

UNLIKE = 0.7
"""Mean difference of the descriptors in the first draft above which another map is given up.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.57 or less, all but one wrong 0.75 to 1.2.
"""


def reconsidered(found: Alignment, matched: Alignment, clock: Part) -> Alignment:
    """Return what another maximum of the search leads to, where the best is doubtful, or mirrored without need.

    A hundred samples may prefer a wrong map, as where both scans lack a part, or where one lacks the left and one the
    right of something symmetric. All vertices, once bent, tell whether another fits.

    Parameters
    ----------
    found, matched : Alignment
        What the search's best led to, and this before it was bent.
    """

    def sure(alignment: Alignment) -> float:
        return float(alignment.confidence @ alignment.target.mesh.vertex_areas)

    turned = None
    if matched.other is not None:
        # what was said is of the one search and its rival
        said = tuple(unproved(matched.other))
        turned = replace(matched, search=matched.other, other=matched.search, rival=None, warnings=said)
    if turned is not None and matched.margin is not None and matched.mobius.reflected:
        other = _fitting(turned, clock.part(0.0, 0.5, "reconsider"), best=True)
        if other is not None and sure(other) > DOUBTFUL * sure(found):
            said = (
                f"ambiguous orientation: mirrored scores {100 * matched.margin:.1f} % of the samples more, but not "
                "mirrored fits too; taken as not mirrored"
            )
            return replace(other, warnings=(said, *other.warnings))
        if found.overlap is not None:
            said = (
                "ambiguous orientation: what the surfaces have in common matches only mirrored; if they show something "
                "symmetric, these are opposite sides of it"
            )
            found = replace(found, warnings=(*found.warnings, said))
    if found.mean_confidence <= DOUBTFUL:
        other = _fitting(matched, clock.part(0.5, 0.75, "reconsider"), best=False)
        if other is not None and sure(other) > sure(found):
            behind = 100 * (matched.search.value - other.value) / len(matched.source_samples)
            said = f"reconsidered: the best map does not fit; one that scores {behind:.1f} % of the samples less does"
            return replace(other, warnings=(said, *other.warnings))
        if turned is not None and matched.margin is not None and not matched.mobius.reflected:
            other = _fitting(turned, clock.part(0.75, 1.0, "reconsider"), best=True)
            if other is not None and sure(other) > sure(found):
                said = (
                    f"reconsidered: not mirrored, which scores {100 * matched.margin:.1f} % of the samples more, does "
                    "not fit; mirrored does"
                )
                return replace(other, warnings=(said, *other.warnings))
    return found


def _fitting(matched: Alignment, clock: Part, *, best: bool) -> Alignment | None:
    """Return what the first of the search's maxima leads to that fits; `best`: it may be the best itself."""
    known: list[Any] = [] if best else [matched.search.mobius]
    for number in range(HYPOTHESES):
        part = clock.part(number / HYPOTHESES, (number + 1) / HYPOTHESES)
        part.begin("reconsider", "Trying the next best map", 0.0)
        rival = rival_of(matched, known, None, part) if known else None
        known.append((rival or matched.search).mobius)
        found = taking(matched, rival, part.within(0.2, 0.4))
        part = part.part(0.4, 1.0)
        first = drafted_from(found, part)
        if unlike(found, first[0], first[2]) > UNLIKE:
            continue
        found = bent_densely(found, first, part, None)
        if found.mean_confidence >= FITS:
            return found
    return None


def unlike(found: Alignment, draft: Draft, there: Booleans) -> float:
    """Return by how much descriptors differ on average, in the draft, where it finds a counterpart; inf if nowhere."""
    used = np.flatnonzero(there & found.target.mesh.used)
    if len(used) == 0:
        return np.inf
    face, barycentric = draft.located(found.target)
    distance = descriptor_distance(
        found.source, found.source_descriptors, found.target_descriptors[used], face[used], barycentric[used]
    )
    areas = found.target.mesh.vertex_areas[used]
    return float(distance @ areas / areas.sum() / np.sqrt(found.source_descriptors.shape[1]))
