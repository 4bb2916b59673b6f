"""What flatten and align compute on: a scan put in order, and results told in the triangles that Blender has.

Nothing of this reaches the person's mesh: faces are left out or turned over, and openings closed, in arrays alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..solver import (
    Alignment,
    AlignSettings,
    Cleaned,
    Correspondence,
    Flattening,
    MeshError,
    Progress,
    TriangleMesh,
    align,
    cleaned,
    correspond,
    flatten,
    topology,
)
from ..solver.mesh import Booleans, Integers, plural
from .mesh_data import Refusal


@dataclass(frozen=True)
class Repair:
    """How the flaws of a scan are dealt with.

    Attributes
    ----------
    fill_holes : bool
        Close all boundary loops but the outer one for the computation.
    largest_part : bool
        Leave out all parts but the one of largest area.
    """

    fill_holes: bool = False
    largest_part: bool = False


def in_order(mesh: TriangleMesh, repair: Repair) -> Cleaned:
    """Return the mesh without degenerate and duplicate faces and other parts, its faces turned to one side.

    Raises
    ------
    MeshError
        It cannot be put in order.
    """
    found = topology(mesh)
    untidy = len(found.degenerate_faces) or len(found.duplicate_faces) or len(found.inconsistent_edges)
    if not untidy and (found.parts == 1 or not repair.largest_part):
        count = len(mesh.faces)
        return Cleaned(mesh, np.arange(count), np.zeros(count, bool), ())
    try:
        return cleaned(mesh, largest_part=repair.largest_part)
    except MeshError as error:
        if n := len(found.non_manifold_edges):  # why no side can be told
            raise MeshError(
                f"'{mesh.name}' has {plural(n, 'edge')} in three or more faces: delete the extra faces"
            ) from error
        raise


def selected_loop(mesh: TriangleMesh, selected: Booleans, repair: Repair) -> int:
    """Return a vertex of the boundary loop that has selected vertices; `selected` is (n,).

    Raises
    ------
    Refusal
        No loop or several loops have selected vertices.
    MeshError
        As `in_order`.
    """
    loops = [loop[selected[loop]] for loop in topology(in_order(mesh, repair).mesh).boundary_loops]
    chosen = [loop for loop in loops if len(loop)]
    if len(chosen) != 1:
        state = f"on {len(chosen)} boundary loops" if chosen else "on no boundary loop"
        raise Refusal(
            f"'{mesh.name}' has selected vertices {state}: in Edit Mode, select vertices of the outer one only"
        )
    return int(chosen[0][0])


def flattened(
    mesh: TriangleMesh, method: str, repair: Repair, *, outer: int | None = None
) -> tuple[Flattening, tuple[str, ...]]:
    """Return the flattening of a mesh put in order, and what was done to it, each a sentence; see `solver.flatten`."""
    tidy = in_order(mesh, repair)
    found = flatten(tidy.mesh, method, fill_holes=repair.fill_holes, outer_vertex=outer)
    return found, (*_changes(mesh, tidy), *_openings(found))


def aligned(
    source: TriangleMesh,
    target: TriangleMesh,
    settings: AlignSettings,
    *,
    largest_part: bool = False,
    landmarks: Integers | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
) -> tuple[Alignment, Correspondence]:
    """Return the alignment of two meshes put in order, and their correspondence in the triangles they came with.

    What was done to the meshes comes first among the alignment's warnings. See `solver.align`.
    """
    repair = Repair(settings.fill_holes, largest_part)
    tidy_source, tidy_target = in_order(source, repair), in_order(target, repair)
    alignment = align(tidy_source.mesh, tidy_target.mesh, settings, progress, landmarks=landmarks)
    found = in_own_triangles(correspond(alignment), tidy_source, source)
    notes = (
        *_changes(source, tidy_source),
        *_changes(target, tidy_target),
        *_openings(alignment.source),
        *_openings(alignment.target),
    )
    return replace(alignment, warnings=(*notes, *alignment.warnings)), found


def in_own_triangles(found: Correspondence, tidy: Cleaned, source: TriangleMesh) -> Correspondence:
    """Return a correspondence with the source put in order as one with the source as it was."""
    if not tidy.changes:
        return found
    located = found.face >= 0
    face = np.where(located, tidy.faces[found.face], -1)
    barycentric = found.barycentric.copy()
    turned = located & tidy.reversed[found.face]
    barycentric[turned] = barycentric[turned][:, [0, 2, 1]]
    return replace(found, face=face, barycentric=barycentric, source_triangles=source.faces)


def _changes(mesh: TriangleMesh, tidy: Cleaned) -> tuple[str, ...]:
    return (f"'{mesh.name}': {', '.join(tidy.changes)}, for the computation only",) if tidy.changes else ()


def _openings(found: Flattening) -> tuple[str, ...]:
    if not found.holes:
        return ()
    edges = ", ".join(f"{len(loop):,}" for loop in found.holes[:6]) + (", ..." if len(found.holes) > 6 else "")
    number = plural(len(found.holes), "opening")
    return (f"'{found.mesh.name}': {number} ({edges} edges) closed, for the computation only",)
