"""What flatten and align compute on: a scan put in order, and results told in the triangles that Blender has.

Nothing of this reaches the person's mesh: faces are left out or turned over, and openings closed, in arrays alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..solver import (
    Alignment,
    AlignSettings,
    Cleaned,
    Correspondence,
    Flattening,
    MeshError,
    Progress,
    SphereFlattening,
    Surface,
    TriangleMesh,
    align,
    cleaned,
    correspond,
    flatten,
    topology,
)
from ..solver.align.surfaces.prepared import cleaning_notes, flattening_notes
from ..solver.flatten.distortion import signed_areas
from ..solver.surface.mesh import Booleans, Floats, Integers, plural
from ..solver.surface.tidy import Piece
from .kept_surfaces import surface_of
from .mesh_data import Refusal


@dataclass(frozen=True)
class Repair:
    """How the flaws of a scan are dealt with.

    Attributes
    ----------
    fill_holes : bool
        Close all boundary loops but the outer one for the computation, and cut small handles.
    largest_part : bool
        Leave out all parts but the one of largest area.
    """

    fill_holes: bool = True
    largest_part: bool = True


@dataclass(frozen=True, eq=False)
class Flat:
    """A mesh flattened in order.

    Attributes
    ----------
    flattening : Flattening
        Of the mesh in order.
    tidy : Cleaned
        That, and how it relates to the mesh as it came.
    notes : tuple of str
        What was done to it, each a sentence.
    """

    flattening: Flattening
    tidy: Cleaned
    notes: tuple[str, ...]


def in_order(mesh: TriangleMesh, repair: Repair, keys: Floats | None = None) -> Cleaned:
    """Return a mesh put in order; see `solver.cleaned`."""
    return cleaned(mesh, largest_part=repair.largest_part, fill_holes=repair.fill_holes, keys=keys)


def selected_loop(mesh: TriangleMesh, selected: Booleans, repair: Repair, keys: Floats | None = None) -> int:
    """Return a vertex of the boundary loop that has selected vertices; `selected` is (n,).

    Raises
    ------
    Refusal
        No loop or several loops have selected vertices.
    MeshError
        As `in_order`.
    """
    tidy = in_order(mesh, repair, keys)
    rims = [tidy.origin[loop] for loop in topology(tidy.mesh).boundary_loops]
    loops = [loop[selected[loop]] for loop in rims]
    chosen = [loop for loop in loops if len(loop)]
    if len(chosen) != 1:
        state = f"on {len(chosen)} boundary loops" if chosen else "on no boundary loop"
        raise Refusal(
            f"'{mesh.name}' has selected vertices {state}: in Edit Mode, select vertices of the outer one only"
        )
    return int(chosen[0][0])


def flattened(
    mesh: TriangleMesh, method: str, repair: Repair, *, outer: int | None = None, keys: Floats | None = None
) -> Flat:
    """Return the flattening of a mesh put in order; see `solver.flatten`."""
    tidy = in_order(mesh, repair, keys)
    vertex = None if outer is None else tidy.vertex_for(outer)
    found = flatten(tidy.mesh, method, fill_holes=repair.fill_holes, outer_vertex=vertex)
    return Flat(found, tidy, (*cleaning_notes(tidy), *flattening_notes(found), *_layout_notes(found)))


def on_sphere(mesh: TriangleMesh, repair: Repair, keys: Floats | None = None) -> tuple[SphereFlattening, Cleaned]:
    """Return the map of a closed mesh, put in order, to the unit sphere; see `solver.flatten_sphere`."""
    surface = Surface(mesh, fill_holes=repair.fill_holes, largest_part=repair.largest_part, keys=keys)
    if (surface.cleaned.mesh.twins < 0).any():
        raise MeshError(f"'{mesh.name}' has a boundary: only what is closed goes to a sphere")
    flat = surface.flattening
    assert isinstance(flat, SphereFlattening)
    return flat, surface.cleaned


def _layout_notes(found: Flattening) -> tuple[str, ...]:
    """Say how many triangles have no area in the single precision of a UV map."""
    stored = np.stack([found.disc.real, found.disc.imag], axis=1).astype(np.float32) / 2 + np.float32(0.5)
    lost = int((signed_areas(stored[:, 0] + 1j * stored[:, 1].astype(np.float64), found.mesh.faces) <= 0).sum())
    if not lost:
        return ()
    return (f"'{found.mesh.name}': {plural(lost, 'triangle')} too small in the disc for the precision of a UV map",)


def aligned(
    source: TriangleMesh,
    target: TriangleMesh,
    settings: AlignSettings,
    *,
    largest_part: bool = True,
    keys: tuple[Floats | None, Floats | None] = (None, None),
    within: tuple[Piece | None, Piece | None] = (None, None),
    landmarks: Integers | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
) -> tuple[Alignment, Correspondence]:
    """Return the alignment of two meshes put in order, and their correspondence in the triangles they came with.

    What was done to the meshes comes first among the alignment's warnings. `keys` are what shape keys say of which
    vertices belong together, `within` the vertices of the pieces that are to be matched, or the edges that cut
    them out. See `solver.align`.
    """
    source_surface, target_surface = (
        surface_of(
            mesh,
            fill_holes=settings.fill_holes,
            largest_part=largest_part,
            outer_vertex=outer,
            keys=own,
            within=piece,
        )
        for mesh, outer, own, piece in (
            (source, settings.source_outer, keys[0], within[0]),
            (target, settings.target_outer, keys[1], within[1]),
        )
    )
    alignment = align(source_surface, target_surface, settings, progress, landmarks=landmarks)
    return alignment, correspond(alignment)
