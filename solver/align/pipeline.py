"""The pipeline: two meshes in, the best Möbius transformation between their discs out, with what is proved about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy.typing as npt

from ..stages import Part, Progress, Stages
from ..surface.mesh import MeshError, TriangleMesh
from .cut.cutting import fitting_pieces, like_pieces
from .diagnosis import causes, coarse, deep
from .doubt.decision import FITS
from .doubt.inside_out import turned_round
from .doubt.other_rim import with_other_rim
from .doubt.own_motion import with_motions_open
from .doubt.reconsider import reconsidered
from .maps.dense import bent_densely, drafted_from
from .maps.mobius_map import roughly_aligned
from .parts.completing import completed
from .result.alignment import Alignment
from .result.confidence import BOUND, DOUBTFUL
from .surfaces.landmarks import own_landmarks
from .surfaces.lips import with_lips_joined
from .surfaces.main_parts import other_mains
from .surfaces.prepared import Surface
from .surfaces.remark import Remark
from .surfaces.settings import AlignSettings
from .surfaces.side_by_side import told_apart


def align(
    source_mesh: TriangleMesh | Surface,
    target_mesh: TriangleMesh | Surface,
    settings: AlignSettings | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
    *,
    landmarks: npt.ArrayLike | None = None,
) -> Alignment:
    """Find where every point of the target belongs on the source; landmarks are not needed.

    With dense refinement the surfaces may show different pieces of the same thing. The overlap is found from a stiff
    draft of the bending, cut out of both, and aligned by itself: `Alignment.overlap`. And a map that is in doubt is
    compared with others, of which the best is taken (`reconsidered`), unless landmarks decide.

    Parameters
    ----------
    source_mesh, target_mesh : TriangleMesh or Surface
        Triangulated discs in any pose, scale and triangulation; those that are aligned several times prepared once, by
        `prepare`. A prepared surface stays as it was prepared, whatever `settings.fill_holes` says.
    settings : AlignSettings, optional
    progress : callable, optional
        Called with a `Progress` at each stage and a few times a second in the search; returns False to cancel.
    landmarks : (l, 2) int, optional
        Source vertex and target vertex of pairs that are known. They join the search as points of more weight, so that
        a few wrong ones are outvoted.

    Raises
    ------
    MeshError
        A mesh is no disc.
    ValueError
        Landmarks that are no pairs of vertices; a surface prepared with another outer boundary than the settings name.
    Cancelled
        The progress callback returned False.
    """
    settings = settings or AlignSettings()
    clock = Stages(progress)
    source = _surface(source_mesh, settings, settings.source_outer)
    target = _surface(target_mesh, settings, settings.target_outer)
    found, (source, target), used = _with_main_parts(source, target, settings, clock.part(0, 0.98), landmarks)
    found = _with_other_parts(found, source, target, clock.part(0.98, 1))
    clock.end()
    others = found.whole is not None
    first = [one for surface in used for one in surface.remarks(other_parts=others)]
    first += found.whole.remarks if found.whole else ()
    found = found.annotated(seconds=clock.seconds, remarks=(*first, *found.remarks))
    return _with_doubts(found, used)


def _with_doubts(found: Alignment, used: _Both) -> Alignment:
    """Return the alignment with what is to be doubted about it, and why; `used`: the surfaces that were aligned."""
    if found.mean_confidence <= DOUBTFUL:
        said = f"doubtful: more likely than not the map errs by more than {100 * BOUND:.0f} % of the source's diagonal"
        known = causes(found, *used)
        likely = (replace(cause, before="doubtful, perhaps because ") for cause in known)
        doubt = Remark("doubtful", said)
        return found.annotated(remarks=(*found.remarks, doubt, *likely), causes=tuple(one.kind for one in known))
    if found.mean_confidence < FITS and any(one.kind == "partial" for one in found.remarks):
        said = (
            "unsure: what the surfaces have in common fits less well than it should, so what is said to be missing may "
            "only be stretched: look along its edge, or mark points there"
        )
        found = found.annotated(remarks=(*found.remarks, Remark("unsure", said)))
    known = [coarse(found), *(map(deep, used) if found.mean_confidence < FITS else ())]
    told = tuple(cause for cause in known if cause is not None)
    return found.annotated(remarks=(*found.remarks, *told), causes=tuple(cause.kind for cause in told))


_Both = tuple[Surface, Surface]


def _with_main_parts(
    source: Surface, target: Surface, settings: AlignSettings, clock: Part, landmarks: npt.ArrayLike | None
) -> tuple[Alignment, _Both, _Both]:
    """Return the alignment of the main parts, the surfaces with these, and what was used of them.

    The main parts are the largest, or others where these fit.
    """
    named = settings.source_outer is not None or settings.target_outer is not None
    alone = settings.parts == "main" or named
    found = reason = None
    try:
        found = _of_main_parts(source, target, settings, clock.part(0.0, 0.9), landmarks)
    except MeshError as error:  # as of what is closed
        reason = error
    if found is not None and (alone or (found[0].mean_confidence > DOUBTFUL and not _fits_any_way(found[0]))):
        return found[0], (source, target), found[1]
    for one, other in () if alone else other_mains(source, target):
        try:
            again, used = _of_main_parts(one, other, settings, clock.part(0.9, 1.0, "other parts"), landmarks)
        except MeshError:
            continue
        if again.mean_confidence > DOUBTFUL:
            said = "the largest parts do not belong together: others, which do, are taken for the main ones"
            return again.annotated(remarks=(Remark("other parts", said), *again.remarks)), (one, other), used
    if found is None:
        assert reason is not None
        raise reason
    return found[0], (source, target), found[1]


def _fits_any_way(found: Alignment) -> bool:
    """Return whether closed parts fit in several ways, as a ball does, so that they tell nothing of the others."""
    margin = found.rival_margin
    return found.source.domain.closed and margin is not None and margin <= found.settings.reflect_margin


def _of_main_parts(
    source: Surface, target: Surface, settings: AlignSettings, clock: Part, landmarks: npt.ArrayLike | None
) -> tuple[Alignment, _Both]:
    """Return the alignment of the main parts of two surfaces, or of a piece of one of them, and what was aligned."""
    source, target, joined = with_lips_joined(source, target)
    source, target, said = fitting_pieces(source, target, settings, clock.part(0, 0.05))
    pairs = own_landmarks(landmarks, source.cleaned, target.cleaned)
    found = matched = roughly_aligned(source, target, settings, clock.part(0.05, 0.45), pairs)
    if settings.refine == "dense":
        part = clock.part(0.45, 0.95)
        first = drafted_from(matched, part)
        found = bent_densely(matched, first, part, pairs)
        other = turned_round(found, source, target, clock.part(0.95, 0.96), pairs)
        rim = None if other else with_other_rim(found, source, target, clock.part(0.96, 0.97), pairs)
        decided = settings.take_rival or pairs is not None  # by the user
        if other is not None:
            found, target = other
        elif rim is not None:
            found, source, target = rim
        elif not decided:
            found = reconsidered(found, matched, first, clock.part(0.97, 1))
        if not decided:
            found = with_motions_open(found)
        unfit = not (decided or other or rim) and found.mean_confidence <= DOUBTFUL
        if unfit and settings.cut and all(map(deep, (source, target))):
            again = like_pieces(source, target, settings, clock.part(0.97, 0.98))
            if again is not None:
                cut, used = _of_main_parts(again[0], again[1], settings, clock.part(0.98, 1.0), None)
                if cut.mean_confidence > DOUBTFUL:
                    return cut.annotated(remarks=(*joined, *again[2], *cut.remarks)), used
    return found.annotated(remarks=(*joined, *said, *found.remarks)), (source, target)


def _with_other_parts(found: Alignment, source: Surface, target: Surface, clock: Part) -> Alignment:
    """Return the alignment with what belongs to what beyond the main parts, if that is asked for and there is more."""
    if found.settings.parts == "main" or not (source.largest_part and target.largest_part):
        return found
    clock.begin("parts", "Pairing parts", 0.0)
    told_apart(source, target, found.settings, clock.within(0.0, 0.0))
    return found.annotated(whole=completed(found, source.parts, target.parts, clock.within(0.0, 1.0)))


def _surface(mesh: TriangleMesh | Surface, settings: AlignSettings, outer_vertex: int | None) -> Surface:
    """Return a surface as it is, and a mesh as one."""
    if not isinstance(mesh, Surface):
        return Surface(mesh, fill_holes=settings.fill_holes, outer_vertex=outer_vertex, largest_part=True)
    if outer_vertex is not None and mesh.cleaned.vertex_for(outer_vertex) not in mesh.flattening.boundary:
        raise ValueError(f"'{mesh.mesh.name}' was prepared with another outer boundary than that of {outer_vertex}")
    return mesh
