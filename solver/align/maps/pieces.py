"""The parts that two surfaces share, aligned by themselves as surfaces of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ...bend.bend import finished
from ...bend.draft import Draft, drafted
from ...bend.plate import CUT_REACH
from ...mobius import hyperbolic_distance
from ...search.rival import ELSEWHERE
from ...stages import Part
from ...surface.mesh import Booleans, Floats, Integers, MeshError
from ...surface.tidy import Cleaned
from ..result.alignment import Alignment, Overlap
from ..result.confidence import SURE
from ..result.overlap import Piece, shared
from ..surfaces.prepared import Surface
from ..surfaces.remark import Remark
from .mobius_map import challenged, implied, improved, searched, valued

SMALLEST_OVERLAP = 0.1
"""Share of either surface's area below which an overlap is no ground to go on from."""


@dataclass(frozen=True, eq=False)
class Searched:
    """What two surfaces seem to share, searched by itself.

    Attributes
    ----------
    inner : Alignment
    source_part, target_part : Piece
    sure : bool
        Whether its samples match better than those of the wholes, beyond chance.
    """

    inner: Alignment
    source_part: Piece
    target_part: Piece
    sure: bool


def searched_alone(
    found: Alignment, source_part: Piece | None, target_part: Piece | None, clock: Part, landmarks: Integers | None
) -> Searched | None:
    """Search the parts that the surfaces seem to share; None where they are too small."""
    if source_part is None or target_part is None:
        return None
    if min(_shares(found, source_part, target_part)) < SMALLEST_OVERLAP:
        return None
    settings = replace(
        found.settings,
        reflect="always" if found.mobius.reflected else "never",
        take_rival=False,
        source_outer=source_part.outer,
        target_outer=target_part.outer,
    )
    try:
        pairs = _within(landmarks, source_part, target_part)
        source, target = (
            Surface(
                part.mesh,
                fill_holes=settings.fill_holes,
                outer_vertex=part.outer,
                tidy=Cleaned.unchanged(part.mesh),
            )
            for part in (source_part, target_part)
        )
        inner = searched(source, target, settings, clock, pairs)
    except MeshError:  # too small a piece to flatten
        return None
    return Searched(inner, source_part, target_part, _surely_better(inner.matched_weights, found.matched_weights))


def overlap_of(found: Alignment, draft: Draft, alone: Searched, searching: Part, clock: Part) -> Overlap:
    """Bend what two surfaces share, by a draft of the whole."""
    source_part, target_part = alone.source_part, alone.target_part
    inner = challenged(alone.inner, searching)
    face, barycentric = draft.located(found.target)
    inner = _consistent(inner, source_part, face[target_part.vertices], barycentric[target_part.vertices])

    clock.begin("bend", "Bending", 0.0)
    scale = np.sqrt(found.source.mesh.area / source_part.mesh.area)
    middle = draft.onto.mesh.vertices[source_part.vertices[inner.source.boundary]].mean(axis=0)
    start = scale * (draft.places()[target_part.vertices] - middle)
    again = drafted(inner.mobius, inner.source, inner.target, start=start, progress=clock.within(0.0, 0.2))
    _, there = shared(again, inner.source, inner.target, clock.within(0.2, 0.2))
    bending = finished(
        again,
        inner.source,
        inner.target,
        _alike(again, inner, source_part.cut, target_part.cut),
        clock.within(0.2, 1.0),
        CUT_REACH,
    )
    inner = replace(inner, bending=bending, counterpart=there)
    return Overlap(inner, source_part, target_part, *_shares(found, source_part, target_part), face, barycentric)


def _shares(found: Alignment, source_part: Piece, target_part: Piece) -> tuple[float, float]:
    """Return the shares of the surfaces' areas in the parts."""
    return source_part.mesh.area / found.source.mesh.area, target_part.mesh.area / found.target.mesh.area


def _surely_better(parts: Floats, whole: Floats) -> bool:
    """Return whether the samples of the parts, (k,), match better than those of the whole, (l,), beyond chance.

    The difference of the means in its standard errors (Welch 1947), against `SURE`: rims that merely differ a bit, or a
    draft that was mistaken, gain no more than other samples would.
    """
    error = np.sqrt(parts.var() / len(parts) + whole.var() / len(whole))
    return bool(parts.mean() - whole.mean() > SURE * error)


def _within(pairs: Integers | None, source: Piece, target: Piece) -> Integers | None:
    """Return the landmarks that lie in both pieces, as vertices of these."""
    if pairs is None:
        return None
    rows = [np.searchsorted(part.vertices, column) for part, column in zip((source, target), pairs.T, strict=True)]
    inside = [
        part.vertices[np.minimum(row, len(part.vertices) - 1)] == column
        for part, row, column in zip((source, target), rows, pairs.T, strict=True)
    ]
    return np.stack(rows, axis=1)[inside[0] & inside[1]]


def _consistent(inner: Alignment, source: Piece, face: Integers, barycentric: Floats) -> Alignment:
    """Return the pieces' alignment, with the transformation that the draft of the whole implies if it found another.

    `face`, (k,), and `barycentric`, (k, 3), are where the draft puts the target piece's vertices on the whole source.
    """
    place = np.searchsorted(source.faces, face)
    place = np.minimum(place, len(source.faces) - 1)
    there = np.flatnonzero((source.faces[place] == face) & np.isfinite(inner.target.places.real))
    expected = (inner.source.places[source.mesh.faces[place[there]]] * barycentric[there]).sum(axis=1)
    disc = inner.target.places[there]
    inside = (np.abs(expected) < 1 - 1e-6) & (np.abs(disc) < 1 - 1e-6)
    expected, disc = expected[inside], disc[inside]
    apart = hyperbolic_distance(inner.mobius.inverse()(disc), expected)
    if len(apart) < 3 or np.median(apart) < ELSEWHERE:
        return inner
    mobius = implied(expected, disc, np.ones(len(disc)), inner.mobius.reflected)
    said = "ambiguous: the best map of the pieces by themselves sends everything elsewhere"
    inner = improved(replace(inner, mobius=mobius, remarks=(*inner.remarks, Remark("rival", said))), inner.difference)
    return replace(inner, taken=valued(inner.objective, inner.mobius))


def _alike(draft: Draft, inner: Alignment, source_cut: Booleans, target_cut: Booleans) -> Booleans:
    """Return the target vertices, (n,), that are near a boundary that the whole surfaces have, not one of a cut."""
    places = draft.places()
    loops = np.concatenate([inner.source.boundary, *inner.source.holes])
    nearest = loops[KDTree(draft.onto.mesh.vertices[loops]).query(places)[1]]
    return ~target_cut & ~source_cut[nearest]
