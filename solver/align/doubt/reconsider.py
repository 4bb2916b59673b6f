"""Which of several maps is taken, where the search's best is in doubt: the one place that decides.

Hypotheses are the other orientation, further maxima of the search, and what a rigid pose implies. Those of which the
samples promise enough (`chances`) are drafted, by few vertices first, and given up there if another draft fits clearly
better; what is left is bent like the first, and all are judged by the same calibrated measure: how much of the target
is surely right (`Alignment.confidence`). A mirrored map has to be better than any other by more than chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import chain
from typing import TypeVar

import numpy as np

from ...bend.bend import Draft
from ...bend.plate import RIM_REACH
from ...stages import Part
from ...surface.mesh import Booleans, Floats
from ..maps.dense import begun, bent_densely, drafted_from
from ..result.alignment import Alignment
from ..result.confidence import DOUBTFUL
from ..surfaces.remark import Remark
from ..surfaces.side_by_side import Work, side_by_side, stages_of
from .chances import draft_may_reach, may_reach
from .hypotheses import SIDES, Hypothesis, apart, by_own_mirror, by_pose, further, roughly_unlike, turned, unlike
from .opposite import with_sides_open

FITS = 0.75
"""Mean confidence from which on a map that is not mirrored is taken as it is.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.72 or more, the wrong ones that were not
mirrored 0.31 or less; a sheet, not mirrored where mirrored is right, 0.55.
"""

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

PROVED = 1.15
"""Factor by which more of the target has to be surely right by another map of one orientation for it to be taken."""

MIRRORED = 1.5
"""The same for a mirrored map beside one that is not.

Of 8 pairs of noisy faces and one seen by a camera, nearly symmetric, mirrored wrong maps had up to 1.22 times as much
as the right ones; on mirrored hands, feet, ears and teeth the right ones had 1.9 times as much, or more, as any that
was not mirrored: the middle of the two.
"""

OPPOSITE = 4 / 7
"""Share of either scan that both show of one thing from which 30 %, as much as is found, are missing on opposite sides.

A map that is not mirrored and fits on as much is taken, though of something symmetric a mirrored one covers more. Of
mirrored hands, feet, ears and teeth, maps that were not mirrored had a mean confidence of 0.44 at most.
"""

OPEN = 1.02
"""Factor from which on it is said that a mirrored map, which is not taken, fits better; where neither fits, one that
does not fit worse by as much: a head that is nearly symmetric had 1.01, and was the mirrored one."""


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
    for score, each, draft in drafts:
        # where one from a Möbius map has come to the same, that is the one: its samples say more of it
        others = [other[0].now for _, one, other in drafts if each.start is not None and one.start is None]
        again = any(_same(draft[0].now, other) for other in (*known, *others))
        if not again and _fitting(score, least, found, each) and len(chosen) < BENT:
            known.append(draft[0].now)
            chosen.append((each, draft))
    works = [partial(_bent, each, draft) for each, draft in chosen]
    bent = side_by_side(works, clock.within(0.5, 1.0), threads=threads)
    decided = _decided([(found, ""), *zip(bent, (each.what for each, _ in chosen), strict=True)])
    return with_sides_open(decided, any(each.what == SIDES for each in hypotheses))


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
    drafts = [one for one in drafts if draft_may_reach(one[1].alignment, one[2], _needed(found, one[1].alignment))]
    # at the nodes, which all drafts by few share
    known = [] if found.unfolded >= UNFOLDED else [first[0].places()[likewise.few.nodes]]
    others = []
    # where more vertices begin at the Möbius map they may end elsewhere than where they begin at given places
    begun_alike: dict[bool, list[Floats]] = {True: [], False: []}
    for score, each, draft in drafts:
        before = begun_alike[each.start is None]
        if not any(_same(draft.now, other) for other in (*known, *before)):
            before.append(draft.now)
            others.append((score, each))
    if not others:
        return []
    least = ROUGHLY * min(least, others[0][0])
    return [each for score, each in others if _fitting(score, least, found, each)]


def _fitting(score: float, least: float, found: Alignment, each: Hypothesis) -> bool:
    """Return whether a draft fits well enough to be bent on; of a mirrored map it is asked whether any other fits."""
    return score <= WORSE**2 * least or (found.mobius.reflected and not each.alignment.mobius.reflected)


def _without_tie(found: Alignment) -> Alignment:
    """Return the alignment without a word about orientations that tie in the search: the bent maps decide."""
    return found.annotated(remarks=tuple(one for one in found.remarks if one.kind != "orientation"))


def _same(one: Floats, two: Floats) -> bool:
    """Return whether two drafts put most of the target in the same place, (q, 3) each."""
    return bool(np.median(np.linalg.norm(one - two, axis=1)) < SAME)


def _hypotheses(found: Alignment, matched: Alignment, draft: Draft, clock: Part) -> list[Hypothesis]:
    """Return what else the map might be: the likelier the map is wrong, the more."""
    clock.begin("reconsider", "Trying another map", 0.0)

    def worth(one: Alignment, samples: float) -> bool:
        return may_reach(samples, len(one.source_samples), _needed(found, one))

    turns: list[Hypothesis] = []
    works: list[Work[list[Hypothesis]]] = []
    other = turned(matched)
    if other is not None:
        what = "the mirrored one" if other.mobius.reflected else "the one that is not mirrored"
        turns.append(Hypothesis(other, None, what))
    if other is not None and matched.mobius.reflected:
        works.append(lambda note: list(further(other, MAXIMA - 1, partial(worth, other), stages_of(note))))
        works.append(lambda _: [one for one in (by_own_mirror(matched, draft),) if one is not None])
    if found.mean_confidence < FITS:
        nodes = draft.few.nodes

        def known(start: Floats) -> bool:
            return found.unfolded < UNFOLDED and _same(start[nodes], draft.now)

        works.append(lambda _: [one for one in (by_pose(matched, draft.onto, known),) if one is not None])
    if found.mean_confidence <= DOUBTFUL:
        works.append(lambda note: list(further(matched, MAXIMA, partial(worth, matched), stages_of(note))))
    some = side_by_side(works, clock.within(0.0, 1.0), threads=found.settings.threads != 1)
    tried = [*turns, *chain.from_iterable(some)]
    # of sides that share little the samples of the whole match as little
    return [each for each in tried if each.what == SIDES or worth(each.alignment, each.alignment.value)]


def _needed(found: Alignment, other: Alignment) -> float:
    """Return how much of the target another map has to make sure, at least, to be taken, or to be spoken of.

    See `_decided`: a map that fits may be taken beside one that makes more sure.
    """
    if other.mobius.reflected == found.mobius.reflected:
        more = PROVED
    else:
        more = 1 / OPEN if other.mobius.reflected else OPPOSITE * FITS
    return min(FITS, more * _sure(found))


def _decided(bent: list[tuple[Alignment, str]]) -> Alignment:
    """Return the best of bent maps, the first of which is the search's best; mirrored only by proof."""
    plain = [one for one in bent if not one[0].mobius.reflected]
    mirrored = [one for one in bent if one[0].mobius.reflected]
    best, said = _ahead(plain or mirrored), ""
    if plain and mirrored:  # each by itself, then by proof
        one, two = (_ahead(some) for some in (plain, mirrored))
        ahead = _sure(two[0]) / max(_sure(one[0]), 1e-12)
        fits = one[0].mean_confidence >= FITS
        best = one if ahead < MIRRORED or (fits and ahead < 1 / (OPPOSITE * FITS)) else two
        if best is two and fits:
            said = (
                f"ambiguous orientation: not mirrored, {100 * _sure(one[0]):.0f} % of the target are surely right too, "
                f"mirrored {100 * _sure(two[0]):.0f} %; taken as mirrored"
            )
        if best is one and ahead > (OPEN if one[0].mean_confidence >= FITS else 1 / OPEN):
            said = (
                f"ambiguous orientation: mirrored, {100 * _sure(two[0]):.0f} % of the target are surely right, not "
                f"mirrored {100 * _sure(one[0]):.0f} %; taken as not mirrored"
            )
    found, what = best
    if found.mobius.reflected and found.overlap is not None and found.other is not None:
        # the other sides of two pieces of something symmetric fit each other as well as one side fits itself
        said = (
            "ambiguous orientation: what the surfaces have in common matches only mirrored; if they show something "
            "symmetric, these are opposite sides of it"
        )
    remarks = found.remarks
    if what:
        text = f"reconsidered: the best map of the search fits less well than {what}, which is taken"
        remarks = (Remark("reconsidered", text), *remarks)
    return found.annotated(remarks=(Remark("orientation", said), *remarks) if said else remarks)


def _ahead(bent: list[tuple[Alignment, str]]) -> tuple[Alignment, str]:
    """Return the first of maps of one orientation, unless another fits that does not, or is better beyond chance."""
    most = max(_sure(found) for found, _ in bent)
    fitting = [one for one in bent if one[0].mean_confidence >= FITS and _sure(one[0]) > DOUBTFUL * most]
    some = fitting or bent
    best = max(some, key=lambda one: _sure(one[0]))
    return best if _sure(best[0]) > PROVED * _sure(some[0][0]) else some[0]


def _sure(found: Alignment) -> float:
    """Return the mean confidence over the target's whole area."""
    return float(found.confidence @ found.target.mesh.vertex_areas / found.target.mesh.area)
