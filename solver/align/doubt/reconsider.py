"""Other maps that are tried, where the search's best is in doubt, until one of them can be taken (`decision`).

Hypotheses are the other orientation, further maxima of the search, and what a rigid pose implies. Each is drafted, by
few vertices first, and given up there if another draft fits clearly better; what is left is bent like the first, and
all are judged by the same calibrated measure: how much of the target is surely right (`Alignment.confidence`). A
mirrored map has to be better than any other by more than chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import chain
from typing import TypeVar

import numpy as np

from ...bend.draft import Draft
from ...bend.plate import RIM_REACH
from ...stages import Part
from ...surface.mesh import Booleans, Floats
from ..maps.dense import begun, bent_densely, drafted_from
from ..result.alignment import Alignment
from ..result.confidence import DOUBTFUL
from ..surfaces.side_by_side import Work, side_by_side, stages_of
from .decision import FITS, decided
from .hypotheses import SIDES, Hypothesis, apart, by_own_mirror, by_pose, further, roughly_unlike, turned, unlike
from .opposite import with_sides_open

UNFOLDED = 0.2
"""Share of the vertices that the unfolding moved from which on a map is in doubt: on 157 pairs of all kinds 34 had as
much, among them all 12 wrong ones."""

MAXIMA = 3
"""Maxima of the search that are tried, at most, beside the best; of the other orientation with it."""

BENT = 2
"""Hypotheses that are bent all the way, at most."""

UNLIKE = 0.7
"""Mean difference of the descriptors in the first draft above which another map is given up.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.57 or less, all but one wrong 0.75 to 1.2.
"""

SCREENED = 300
"""Vertices of the target by which hypotheses are drafted first, of which few are drafted by more."""

ROUGHLY = 1.1
"""Factor by which such a draft may fit worse, relative to the best one, than one by more vertices.

Of 37 hypotheses of 22 doubtful pairs of all kinds they fitted 0.59 to 1.04 times as badly; of 14 whose descriptors
differed by nearly `UNLIKE`, by one or the other, none is lost.
"""

WORSE = 1.2
"""Factor by which a draft may fit worse than the best one, in descriptors and in how it lies, to be bent on."""

SAME = RIM_REACH
"""Median distance, in roots of the source's area, up to which two drafts are of one map: what Möbius maps err by."""


def in_doubt(found: Alignment) -> bool:
    """Return whether other maps are to be tried: mirrored, far from sure, or hardly to be unfolded."""
    return found.mobius.reflected or found.mean_confidence < FITS or found.unfolded >= UNFOLDED


def reconsidered(
    found: Alignment, matched: Alignment, first: tuple[Draft, Booleans, Booleans], clock: Part
) -> Alignment:
    """Return the best of several maps where the first is in doubt, else the first; and whether the choice is open.

    Parameters
    ----------
    found, matched : Alignment
        What the search's best led to, and this before it was bent.
    first : Draft, (n_source,) bool and (n_target,) bool
        What it was bent from, as of `drafted_from`.
    """
    found = _without_tie(found)
    if not in_doubt(found):
        return found
    threads = found.settings.threads != 1
    matched = _without_tie(matched)
    hypotheses = _hypotheses(found, matched, first[0], clock.part(0.0, 0.25, "reconsider"))
    likely = _screened(found, matched, first, hypotheses, clock.part(0.25, 0.4, "reconsider"))
    rough = unlike(matched, first[0], first[2]) * apart(first[0])
    clock.part(0.4, 0.5, "reconsider").begin("reconsider", "Trying another map", 0.0)
    works = [partial(_drafted, each, first[0]) for each in likely]
    drafts = _in_order(side_by_side(works, clock.within(0.4, 0.5), threads=threads))
    least = min(rough, drafts[0][0]) if drafts else rough
    chosen: list[tuple[Hypothesis, _Draft]] = []
    # a map that could not be unfolded may be the right one all the same, and come out from another start
    known = [] if found.unfolded >= UNFOLDED else [first[0].now]
    from_mobius = [draft[0].now for _, each, draft in drafts if each.start is None]
    for score, each, draft in drafts:
        # where one from a Möbius map has come to the same, that is the one: its samples say more of it
        others = from_mobius if each.start is not None else []
        again = any(_same(draft[0].now, other) for other in (*known, *others))
        if not again and _fitting(score, least, found, each) and len(chosen) < BENT:
            known.append(draft[0].now)
            chosen.append((each, draft))
    works = [partial(_bent, each, draft) for each, draft in chosen]
    bent = side_by_side(works, clock.within(0.5, 1.0), threads=threads)
    best = decided([(found, ""), *zip(bent, (each.what for each, _ in chosen), strict=True)])
    symmetric = any(each.what == SIDES for each in hypotheses)
    return with_sides_open(best, symmetric if _asks_own_mirror(matched) else None)


_Draft = tuple[Draft, Booleans, Booleans]
"""As of `drafted_from`."""

Kept = TypeVar("Kept")

_Scored = tuple[float, Hypothesis, _Draft]


def _drafted(each: Hypothesis, like: Draft, note: Callable[[float], None]) -> _Scored | None:
    """Return a hypothesis with its draft and how badly that fits; None if it is too unlike."""
    draft = drafted_from(each.alignment, stages_of(note), each.start, like)
    differs = unlike(each.alignment, draft[0], draft[2])
    return (differs * apart(draft[0]), each, draft) if differs <= UNLIKE else None


def _roughly_drafted(
    each: Hypothesis, like: Draft, note: Callable[[float], None]
) -> tuple[float, Hypothesis, Draft] | None:
    """Return the same by a draft by `SCREENED` vertices, asked at these."""
    draft = begun(each.alignment, stages_of(note), each.start, SCREENED, like)
    differs = roughly_unlike(each.alignment, draft)
    return (differs * apart(draft), each, draft) if differs <= ROUGHLY * UNLIKE else None


def _in_order(drafts: Iterable[tuple[float, Hypothesis, Kept] | None]) -> list[tuple[float, Hypothesis, Kept]]:
    """Return the drafts that there are, those that fit best first."""
    return sorted((one for one in drafts if one is not None), key=lambda one: one[0])


def _bent(each: Hypothesis, draft: _Draft, note: Callable[[float], None]) -> Alignment:
    return bent_densely(each.alignment, draft, stages_of(note), None)


def _screened(
    found: Alignment,
    matched: Alignment,
    first: tuple[Draft, Booleans, Booleans],
    hypotheses: list[Hypothesis],
    clock: Part,
) -> list[Hypothesis]:
    """Return the hypotheses that a draft by few vertices does not show to be lost, or to be the first once more."""
    if not hypotheses:
        return []
    likewise = begun(matched, clock.part(0.0, 0.1), None, SCREENED, first[0], first[0].way)
    least = roughly_unlike(matched, likewise) * apart(likewise)
    clock.begin("reconsider", "Trying another map", 0.1)
    works = [partial(_roughly_drafted, each, likewise) for each in hypotheses]
    drafts = _in_order(side_by_side(works, clock.within(0.1, 1.0), threads=found.settings.threads != 1))
    if found.unfolded < UNFOLDED:  # else the right one may be the same, and be unfolded from another start
        before = first[0].places()[likewise.few.nodes]
        drafts = [one for one in drafts if not _same(one[2].now, before)]
    others = _each_once(drafts)
    if not others:
        return []
    least = ROUGHLY * min(least, others[0][0])
    return [each for score, each, _ in others if _fitting(score, least, found, each)]


def _each_once(drafts: list[tuple[float, Hypothesis, Draft]]) -> list[tuple[float, Hypothesis, Draft]]:
    """Return the drafts, best first, without those of a map that is among them already.

    One that begins at its Möbius map and one that begins at given places both stay: with more vertices they may part.
    """
    kept: list[tuple[float, Hypothesis, Draft]] = []
    for one in drafts:
        alike = [other for other in kept if (other[1].start is None) == (one[1].start is None)]
        if not any(_same(one[2].now, other[2].now) for other in alike):
            kept.append(one)
    return kept


def _fitting(score: float, least: float, found: Alignment, each: Hypothesis) -> bool:
    """Return whether a draft fits well enough to be bent on; of a mirrored map it is asked whether any other fits."""
    return score <= WORSE**2 * least or (found.mobius.reflected and not each.alignment.mobius.reflected)


def _without_tie(found: Alignment) -> Alignment:
    """Return the alignment without a word about orientations that tie in the search: the bent maps decide."""
    return found.annotated(remarks=tuple(one for one in found.remarks if one.kind != "orientation"))


def _same(one: Floats, two: Floats) -> bool:
    """Return whether two drafts put most of the target in the same place, (q, 3) each."""
    return bool(np.median(np.linalg.norm(one - two, axis=1)) < SAME)


def _asks_own_mirror(matched: Alignment) -> bool:
    """Return whether the source's own plane of symmetry is looked for, as a hypothesis (`by_own_mirror`)."""
    return matched.mobius.reflected and matched.other is not None


def _hypotheses(found: Alignment, matched: Alignment, draft: Draft, clock: Part) -> list[Hypothesis]:
    """Return what else the map might be: the likelier the map is wrong, the more."""
    clock.begin("reconsider", "Trying another map", 0.0)

    turns: list[Hypothesis] = []
    works: list[Work[list[Hypothesis]]] = []
    other = turned(matched)
    if other is not None:
        what = "the mirrored one" if other.mobius.reflected else "the one that is not mirrored"
        turns.append(Hypothesis(other, None, what))
    if other is not None and _asks_own_mirror(matched):
        works.append(lambda note: list(further(other, MAXIMA - 1, stages_of(note))))
        works.append(lambda _: [one for one in (by_own_mirror(matched, draft),) if one is not None])
    if found.mean_confidence < FITS:
        nodes = draft.few.nodes

        def known(start: Floats) -> bool:
            return found.unfolded < UNFOLDED and _same(start[nodes], draft.now)

        works.append(lambda _: [one for one in (by_pose(matched, draft.onto, known),) if one is not None])
    if found.mean_confidence <= DOUBTFUL:
        works.append(lambda note: list(further(matched, MAXIMA, stages_of(note))))
    some = side_by_side(works, clock.within(0.0, 1.0), threads=found.settings.threads != 1)
    return [*turns, *chain.from_iterable(some)]
