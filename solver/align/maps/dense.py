"""From a Möbius map to a dense one: bent onto the source as a whole, or, where the scans differ, what both show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...bend.bend import finished
from ...bend.draft import NODES, ROUNDS, Draft, drafted
from ...flatten.distortion import signed_areas
from ...flatten.sphere import Flat
from ...stages import Part
from ...surface.mesh import Booleans, Floats, Integers
from ..result.agreement import trust
from ..result.alignment import Alignment, Overlap
from ..result.overlap import piece, shared
from ..surfaces.remark import Remark
from .pieces import overlap_of, searched_alone
from .stretched import agrees_better, shows_what_is_missing

PARTIAL = 0.02
"""Share of either surface's area without a counterpart from which on the rest is cut out and aligned anew."""

SETTLED = 0.005
"""Change of the shares without a counterpart below which an overlap is settled."""

DRAFTS = 4
"""Drafts at most until the overlap is settled."""


def drafted_from(
    found: Alignment,
    clock: Part,
    start: Floats | None = None,
    like: Draft | None = None,
) -> tuple[Draft, Booleans, Booleans]:
    """Return a first draft of the bending, and the vertices of source and target that have a counterpart by it.

    It begins at the Möbius map, or where the target's vertices are nearly, (n, 3), in the frame of `Draft.onto`.
    `like` is as for `bend.drafted`.
    """
    draft = begun(found, clock, start, NODES, like)
    return draft, *shared(draft, found.source, found.target, clock.within(0.15, 0.2))


def begun(
    found: Alignment, clock: Part, start: Floats | None, count: int, like: Draft | None, way: int | None = None
) -> Draft:
    """Return a draft of the bending by `count` vertices of the target, begun as one of `drafted_from`."""
    clock.begin("bend", "Bending", 0.0)
    source, target = found.source, found.target
    believed = trust(
        found.mobius,
        source,
        target,
        found.source_descriptors,
        found.target_descriptors,
        found.difference,
    )
    tell = clock.within(0.0, 0.15)
    return drafted(found.mobius, source, target, believed, start, count=count, progress=tell, like=like, way=way)


def bent_densely(
    found: Alignment,
    first: tuple[Draft, Booleans, Booleans],
    clock: Part,
    landmarks: Integers | None,
) -> Alignment:
    """Bend the target onto the source from a first draft; where they show different pieces, what they share."""
    source, target = found.source, found.target
    draft, here, there = first
    alone = None
    searching = clock.part(0.2, 0.4, "overlap")
    if max(left_out(source, target, here, there)) > PARTIAL:
        clock.begin("overlap", "Finding the overlap", 0.2)
        still = clock.within(0.2, 0.2)
        for _ in range(DRAFTS - 1):
            # pose and scale again, from where the surfaces meet
            believed = np.where(there, 1.0, 1e-3)
            places = draft.places()
            draft = drafted(found.mobius, source, target, believed, places, ROUNDS, progress=still, like=draft)
            before = here, there
            here, there = shared(draft, source, target, still)
            if max(left_out(source, target, here == before[0], there == before[1])) < SETTLED:
                break
        if max(left_out(source, target, here, there)) > PARTIAL:
            alone = searched_alone(found, piece(source, here), piece(target, there), searching, landmarks)
    remarks = found.remarks
    missing = left_out(source, target, here, there)
    if max(missing) > PARTIAL:
        apart = " and ".join(
            f"{100 * share:.0f} % of the {name}"
            for share, name in zip(missing, ("source", "target"), strict=True)
            if share > SETTLED
        )
        remarks += (Remark("partial", f"partial overlap: {apart} without a counterpart on the other surface"),)
    if alone is not None and alone.sure:
        return _of_overlap(found, overlap_of(found, draft, alone, searching, clock.part(0.4, 1.0)), remarks)
    begin, end = (0.5, 1.0) if alone is None else (0.4, 0.7)
    clock.begin("bend", "Bending", begin)
    bending = finished(draft, source, target, progress=clock.within(begin, end))
    as_wholes = replace(found, bending=bending, counterpart=there, remarks=remarks)
    if alone is None or not shows_what_is_missing(as_wholes):
        return as_wholes
    shared_alone = _of_overlap(found, overlap_of(found, draft, alone, searching, clock.part(0.7, 1.0)), remarks)
    return shared_alone if agrees_better(shared_alone, as_wholes) else as_wholes


def _of_overlap(found: Alignment, overlap: Overlap, remarks: tuple[Remark, ...]) -> Alignment:
    """Return the alignment by what two surfaces share alone."""
    target = found.target
    # what the whole discs left open the pieces may decide
    remarks = tuple(one for one in remarks if one.kind != "rival")
    remarks += tuple(replace(one, before=f"in the overlap: {one.before}") for one in overlap.alignment.remarks)
    counterpart = np.zeros(len(target.places), bool)
    counterpart[overlap.target.vertices] = overlap.alignment.counterpart
    found = replace(found, overlap=overlap, remarks=remarks)
    # straight sides may cross the jags of a cut, though none is turned over in the piece's own disc
    areas = signed_areas(found.carried, target.mesh.faces) * (-1 if found.mobius.reflected else 1)
    counterpart[target.mesh.faces[areas <= 0]] = False
    return replace(found, counterpart=counterpart)


def left_out(source: Flat, target: Flat, here: Booleans, there: Booleans) -> tuple[float, float]:
    """Return the shares of the surfaces' areas around vertices that are not `here`, and not `there`."""
    first, second = (
        float(surface.mesh.vertex_areas[~kept].sum() / surface.mesh.area)
        for surface, kept in ((source, here), (target, there))
    )
    return first, second
