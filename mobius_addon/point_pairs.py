"""Pairs of points that a person gives to correct a map: empties on both objects, and the map bent through them.

The empties are the pairs: moving, deleting, saving and undoing them are Blender's own. The map as Align left it is kept
beside the bent one, so that a pair that goes leaves nothing behind, and their order does not matter.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ..solver import TriangleMesh, interpolate
from ..solver.carry.pairs import Corrected, PointPairs, through_pairs
from ..solver.surface.mesh import Complexes
from . import results, stored_alignment
from .attributes import LIVE_FACE, SHARED_COLOR, SHARED_LAYOUT, restored_on_failure
from .landmarks import paired_empties
from .live import write_map
from .mesh_data import Surface, foreach, mirrored, read_surface
from .usable import is_read_only

COLLECTION = "Mobius Pairs"

SIZE = 0.012
"""Radius that an empty is drawn with, as a share of its object's diagonal."""

MOVED = 1e-4
"""Share of the diagonal by which an empty has to be moved to count as moved."""


@dataclass(frozen=True)
class Listed:
    """A pair in the panel.

    Attributes
    ----------
    name : str
    source, target : str
        Names of its empties.
    followed : bool or None
        Whether the map goes through it; None: it is new or was moved since.
    missed : float or None
        By how much the map missed it, in diagonals of the source; None where no way leads there.
    """

    name: str
    source: str
    target: str
    followed: bool | None = None
    missed: float | None = None


def listed(source: bpy.types.Object, target: bpy.types.Object) -> list[Listed]:
    """Return the pairs of two objects, by their names."""
    known = _known(target)
    found = []
    for name, (one, other) in sorted(paired_empties(source, target).items()):
        about = known.get(name)
        here = *one.matrix_local.translation, *other.matrix_local.translation
        size = MOVED * max(*source.dimensions, *target.dimensions, 1e-9)
        if about is None or np.abs(np.subtract(here, about["at"])).max() > size:
            found.append(Listed(name, one.name, other.name))
        else:
            found.append(Listed(name, one.name, other.name, about["followed"], about["missed"]))
    return found


def are_applied(source: bpy.types.Object, target: bpy.types.Object) -> bool:
    """Return whether the map is bent through just the pairs that there are."""
    pairs = listed(source, target)
    return {pair.name for pair in pairs if pair.followed is not None} == set(_known(target)) and all(
        pair.followed is not None for pair in pairs
    )


def add_pair(
    context: bpy.types.Context,
    source: bpy.types.Object,
    target: bpy.types.Object,
    points: tuple[tuple[float, ...], tuple[float, ...]],
) -> str:
    """Put two empties at points of the objects' own spaces, and return the pair's name."""
    taken = paired_empties(source, target)
    number = next(k for k in range(1, len(taken) + 2) if f"Pair {k}" not in taken)
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None or collection.library is not None:
        collection = bpy.data.collections.new(COLLECTION)
    if COLLECTION not in context.scene.collection.children:
        context.scene.collection.children.link(collection)
    for obj, point in zip((source, target), points, strict=True):
        empty = bpy.data.objects.new(f"Pair {number}", None)
        collection.objects.link(empty)
        empty.parent = obj
        empty.location = point
        empty.empty_display_type = "SPHERE"
        empty.empty_display_size = SIZE * float(np.linalg.norm(np.ptp(np.array(obj.bound_box), axis=0)))
        empty.show_in_front = True
    context.view_layer.update()
    return f"Pair {number}"


def remove_pair(source: bpy.types.Object, target: bpy.types.Object, name: str) -> bool:
    """Remove the empties of a pair and, with the last, our collection; return whether there were any."""
    found = paired_empties(source, target).get(name)
    for empty in found or ():
        bpy.data.objects.remove(empty)
    collection = bpy.data.collections.get(COLLECTION)
    if collection is not None and not collection.objects and collection.library is None:
        bpy.data.collections.remove(collection)
    return found is not None


def bend(source: bpy.types.Object, target: bpy.types.Object, *, follow_all: bool) -> tuple[list[str], Corrected | None]:
    """Bend the map as Align left it through all pairs there are, and write it; return their names and what came of it.

    Without pairs the map is as Align left it again, and nothing came of it.

    Raises
    ------
    Refusal
        There is no map, or a mesh has changed since.
    MeshError
        A mesh cannot be read.
    """
    surfaces = read_surface(source), read_surface(target)
    found = stored_alignment.load(target, source, surfaces, unbent=True)
    pairs = paired_empties(source, target)
    names = sorted(pairs)
    if not names:
        with restored_on_failure(target):
            _write(source, target, surfaces, found, None)
        return [], None
    points = [
        np.array([mirrored(obj, np.array(pairs[name][side].matrix_local.translation)) for name in names])
        for side, obj in enumerate((source, target))
    ]
    meshes = surfaces[0].mesh, surfaces[1].mesh
    bent = through_pairs(found, *meshes, PointPairs.near(*meshes, *points), follow_all=follow_all)
    about = {
        name: {
            "at": [*pairs[name][0].matrix_local.translation, *pairs[name][1].matrix_local.translation],
            "followed": bool(bent.followed[k]),
            "missed": float(bent.missed[k]) if np.isfinite(bent.missed[k]) else None,
        }
        for k, name in enumerate(names)
    }
    with restored_on_failure(target):
        _write(source, target, surfaces, bent.correspondence, about)
    return names, bent


def describe(names: list[str], bent: Corrected | None) -> tuple[str, str]:
    """Return a kind of report and a sentence about what came of bending a map."""
    if bent is None:
        return "INFO", rpt_("No point pairs: the map is as Align left it")
    out = [name for name, followed in zip(names, bent.followed, strict=True) if not followed]
    said = rpt_("The map goes through {:,} of {:,} point pairs").format(len(names) - len(out), len(names))
    if out:
        off = [
            f"'{name}' ({bent.missed[names.index(name)]:.1%})"
            if np.isfinite(bent.missed[names.index(name)])
            else f"'{name}'"
            for name in out[:4]
        ]
        said += rpt_("; outvoted, as the map is surer than that: {}").format(", ".join(off))
    short = [name for k, name in enumerate(names) if bent.followed[k] and bent.left[k] > 1e-3]
    if short:
        said += rpt_("; not quite reached: {}").format(", ".join(f"'{name}'" for name in short[:4]))
    if bent.folded:
        said += rpt_("; triangles folded between them: {:,}").format(bent.folded)
    return ("WARNING" if out or short or bent.folded else "INFO"), said


def _known(target: bpy.types.Object) -> dict[str, dict]:
    """Return what is kept of the pairs that the map was bent through last."""
    try:
        return json.loads(target.data.mobius_alignment.pairs or "{}")
    except ValueError:
        return {}


def _write(
    source: bpy.types.Object,
    target: bpy.types.Object,
    surfaces: tuple[Surface, Surface],
    found: stored_alignment.Correspondence,
    about: dict[str, dict] | None,
) -> None:
    """Keep a map on the target, and have its shared layout, its colors and what it follows live show it."""
    stored_alignment.keep_bent(target, found, None if about is None else json.dumps(about))
    if LIVE_FACE in target.data.attributes:
        write_map(target, surfaces[0], found)
    if is_read_only(source):  # it has no layout and colors of this alignment
        return
    layers = source.data.uv_layers.get(SHARED_LAYOUT), target.data.uv_layers.get(SHARED_LAYOUT)
    if None not in layers:
        disc = _carried(foreach(layers[0].uv, "vector", 2, np.float32), surfaces[0], surfaces[1].mesh, found)
        results.write_layout(target, SHARED_LAYOUT, disc, surfaces[1])
    colors = source.data.attributes.get(SHARED_COLOR), target.data.attributes.get(SHARED_COLOR)
    if None not in colors and len(colors[0].data) == len(surfaces[0].mesh.vertices):
        own = foreach(colors[0].data, "color", 4, np.float32)
        results.write_color(target, SHARED_COLOR, interpolate(found, own), found.face >= 0)


def _carried(
    plane: np.ndarray, source: Surface, target: TriangleMesh, found: stored_alignment.Correspondence
) -> Complexes:
    """Return the source's layout, (c, 2), at the corners of the target's triangles, (m, 3) complex; nan: no place."""
    disc = 2 * (plane[:, 0] + 1j * plane[:, 1]).astype(complex) - (1 + 1j)
    disc[(plane == 0).all(axis=1)] = np.nan
    known = found.face >= 0
    there = np.full(len(found.face), complex(np.nan, np.nan))
    there[known] = (disc[source.triangle_corners[found.face[known]]] * found.barycentric[known]).sum(axis=1)
    return there[target.faces]
