"""The pipeline: two meshes in, the best Möbius transformation between their discs out, with what is proved about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy.typing as npt

from ..stages import Progress, Stages
from ..surface.mesh import TriangleMesh
from .alignment import Alignment
from .confidence import BOUND
from .cutting import fitting_pieces
from .dense import bent_densely, drafted_from
from .inside_out import turned_round
from .landmarks import own_landmarks
from .mobius_map import roughly_aligned
from .prepared import Surface
from .reconsider import DOUBTFUL, reconsidered
from .settings import AlignSettings


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
    draft of the bending, cut out of both, and aligned by itself: `Alignment.overlap`. And a map that is doubtful, or
    mirrored, is compared with other maxima of the search, of which one that fits is taken, unless landmarks decide.

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
    source, target, said = fitting_pieces(source, target, settings, clock.part(0, 0.1))
    pairs = own_landmarks(landmarks, source.cleaned, target.cleaned)
    found = matched = roughly_aligned(source, target, settings, clock.part(0.1, 0.7), pairs)
    if settings.refine == "dense":
        part = clock.part(0.7, 0.95)
        found = bent_densely(matched, drafted_from(matched, part), part, pairs)
        other = turned_round(found, source, target, clock.part(0.95, 0.97), pairs)
        if other is not None:
            found, target = other
        elif not settings.take_rival and pairs is None:  # these decide
            found = reconsidered(found, matched, clock.part(0.97, 1))
    clock.end()
    warnings = (*said, *source.notes, *target.notes, *found.warnings)
    found = replace(found, seconds=clock.seconds, warnings=warnings)
    if found.mean_confidence <= DOUBTFUL:
        said = f"doubtful: more likely than not the map errs by more than {100 * BOUND:.0f} % of the source's diagonal"
        found = replace(found, warnings=(*found.warnings, said))
    return found


def _surface(mesh: TriangleMesh | Surface, settings: AlignSettings, outer_vertex: int | None) -> Surface:
    """Return a surface as it is, and a mesh as one."""
    if not isinstance(mesh, Surface):
        return Surface(mesh, fill_holes=settings.fill_holes, outer_vertex=outer_vertex, largest_part=True)
    if outer_vertex is not None and mesh.cleaned.vertex_for(outer_vertex) not in mesh.flattening.boundary:
        raise ValueError(f"'{mesh.mesh.name}' was prepared with another outer boundary than that of {outer_vertex}")
    return mesh
