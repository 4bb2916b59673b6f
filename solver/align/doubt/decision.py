"""Which of several bent maps is taken, and what is said of the others: by how much of the target is surely right."""

from __future__ import annotations

from ..result.alignment import Alignment
from ..result.confidence import DOUBTFUL
from ..surfaces.remark import Remark

FITS = 0.75
"""Mean confidence from which on a map that is not mirrored is taken as it is.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.72 or more, the wrong ones that were not
mirrored 0.31 or less; a sheet, not mirrored where mirrored is right, 0.55.
"""

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


def decided(bent: list[tuple[Alignment, str]]) -> Alignment:
    """Return the best of bent maps, the first of which is the search's best; mirrored only by proof."""
    plain = [one for one in bent if not one[0].mobius.reflected]
    mirrored = [one for one in bent if one[0].mobius.reflected]
    best, said = _ahead(plain or mirrored), ""
    if plain and mirrored:  # each by itself, then by proof
        one, two = (_ahead(some) for some in (plain, mirrored))
        ahead = sure(two[0]) / max(sure(one[0]), 1e-12)
        fits = one[0].mean_confidence >= FITS
        best = one if ahead < MIRRORED or (fits and ahead < 1 / (OPPOSITE * FITS)) else two
        if best is two and fits:
            said = (
                f"ambiguous orientation: not mirrored, {100 * sure(one[0]):.0f} % of the target are surely right too, "
                f"mirrored {100 * sure(two[0]):.0f} %; taken as mirrored"
            )
        if best is one and ahead > (OPEN if one[0].mean_confidence >= FITS else 1 / OPEN):
            said = (
                f"ambiguous orientation: mirrored, {100 * sure(two[0]):.0f} % of the target are surely right, not "
                f"mirrored {100 * sure(one[0]):.0f} %; taken as not mirrored"
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
    most = max(sure(found) for found, _ in bent)
    fitting = [one for one in bent if one[0].mean_confidence >= FITS and sure(one[0]) > DOUBTFUL * most]
    some = fitting or bent
    best = max(some, key=lambda one: sure(one[0]))
    return best if sure(best[0]) > PROVED * sure(some[0][0]) else some[0]


def sure(found: Alignment) -> float:
    """Return the mean confidence over the target's whole area."""
    return float(found.confidence @ found.target.mesh.vertex_areas / found.target.mesh.area)
