"""Which of a file's mesh objects are one thing, as a head with its eyes and teeth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...solver.surface.mesh import Floats
from ..mesh_data import foreach, in_world
from .reading import Imported, listed, meant, require_places
from .unreadable import Unreadable

_TWIN = 0.1
"""Two whose boxes differ by less on every side, of the diagonal, are one thing twice.

Of the heads and bodies at hand the part most like the skin differs by 0.38, a tenth of a skin's vertices by 0.06.
"""

_FLAT = 1e-3
"""Shortest side of a box, in its diagonal, below which what is in it is a plane, up to what files round."""


def together(meshes: list[Imported], path: Path, wanted: str | None) -> tuple[list[Imported], list[str]]:
    """Return the mesh that is named or, without a name, all that are one thing, the largest first, and what to say.

    These are the shown ones whose boxes meet that of the largest, directly or by way of others.

    Raises
    ------
    Unreadable
        As `choose`; or the largest is there twice.
    """
    found = meant(meshes, path, wanted)
    if len(found) == 1:
        require_places(found[0])
        return found, []
    shown = [x for x in found if len(x.obj.data.polygons) and not _is_hidden(x)]
    shown = shown or [x for x in found if len(x.obj.data.polygons)] or found[:1]
    for imported in shown:
        require_places(imported)
    boxes = np.array([_box(x) for x in shown])
    sides = boxes[:, 1] - boxes[:, 0]
    sizes = np.linalg.norm(sides, axis=1)
    areas = np.array([_area(x) for x in shown])
    flat = sides.min(axis=1) < _FLAT * sizes
    if not flat.all():  # a floor or a wall that is larger than the thing is none of its parts
        kept = np.flatnonzero(~flat | (sizes < sizes[~flat].max()))
        shown, boxes, sizes, areas = [shown[k] for k in kept], boxes[kept], sizes[kept], areas[kept]
    main = int(np.argmax(areas))
    apart = np.abs(boxes - boxes[main]).max(axis=(1, 2))
    twins = [x for k, x in enumerate(shown) if k != main and apart[k] < _TWIN * sizes[main]]
    if twins:
        raise Unreadable(
            f"'{path}' has {len(found)} mesh objects ({listed(found)}), of which '{shown[main].name}' and "
            f"'{twins[0].name}' fill the same place: name one as {path}:NAME, hide the other in Blender, or join what "
            "belongs together (Ctrl J)"
        )
    meet = (boxes[:, None, 0] <= boxes[None, :, 1]).all(axis=2)
    _, group = connected_components(coo_array(meet & meet.T), directed=False)
    taken = [k for k in np.argsort(-areas, kind="stable") if group[k] == group[main]]
    result = [shown[k] for k in taken]
    notes = []
    if len(result) > 1:
        notes.append(f"{len(result)} mesh objects of '{path}' count as one ({listed(result)})")
    if left := [x for x in found if x not in result]:
        why = f"hidden, without faces, a floor, or apart from '{result[0].name}'"
        notes.append(
            f"of '{path}' {listed(left)} {'is' if len(left) == 1 else 'are'} left out, {why}: name one as {path}:NAME"
        )
    return result, notes


def _is_hidden(imported: Imported) -> bool:
    obj = imported.obj
    return obj.hide_viewport or obj.hide_render or obj.display_type in ("BOUNDS", "WIRE") or obj.hide_get()


def _box(imported: Imported) -> Floats:
    """Return the corners of an object's box in the world, (2, 3)."""
    places = in_world(imported.obj)
    return np.array([places.min(axis=0), places.max(axis=0)])


def _area(imported: Imported) -> float:
    """Return the area of an object's faces in the world."""
    mesh = imported.obj.data
    mesh.calc_loop_triangles()
    corners = in_world(imported.obj)[foreach(mesh.loop_triangles, "vertices", 3, np.int32)]
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum())
