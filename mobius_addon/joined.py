"""Several mesh objects as one for the computation, joined by Blender beside them, and the way back to each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..solver.surface.mesh import Floats, Integers
from .attributes.record import remember, unedited
from .attributes.table import ROWS
from .mesh_data import foreach, is_mirrored
from .streams import quiet

_DOMAINS = {"POINT": "vertices", "EDGE": "edges", "FACE": "polygons", "CORNER": "loops"}
_NUMBER = "mobius number "
"""Of an attribute that says which element of all objects one of the joined mesh was, with the domain after it."""


@dataclass(frozen=True, eq=False)
class Member:
    """One of the objects that were joined.

    Attributes
    ----------
    obj : bpy.types.Object
        The object itself, on which nothing was changed.
    numbers : mapping of str to (n,) int
        By domain: which element of the whole each of its own is, in its own order.
    turn : (3, 3) float64
        Takes displacements of the whole's `Surface` to those of the object's.
    """

    obj: bpy.types.Object
    numbers: Mapping[str, Integers]
    turn: Floats


@contextmanager
def joined(objects: Sequence[bpy.types.Object], name: str) -> Iterator[tuple[bpy.types.Object, tuple[Member, ...]]]:
    """Lend an object that Blender has joined of copies of mesh objects; it is gone afterwards.

    It has the place, the modifiers and the parent of the first. Groups, shape keys, UV maps, colors and materials of
    one name become one. All objects have to be in Object Mode and shown in the scene of the context.
    """
    copies = _copies(objects)
    offsets = dict.fromkeys(_DOMAINS, 0)
    ranges = [{domain: _numbered(copy.data, domain, offsets) for domain in _DOMAINS} for copy in copies]
    turn = [_directions(obj) for obj in objects]
    whole = _whole(copies, [bpy.context.scene.collection, *objects[0].users_collection], name)
    found = {domain: _taken_off(whole.data, domain) for domain in _DOMAINS}
    remember(whole, (), _written_on_all(objects))
    members = tuple(
        Member(obj, {domain: found[domain][own.start : own.stop] for domain, own in mine.items()}, back)
        for obj, mine, back in zip(objects, ranges, [np.linalg.solve(x, turn[0]) for x in turn], strict=True)
    )
    try:
        yield whole, members
    finally:
        mesh = whole.data
        bpy.data.objects.remove(whole)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)


def joined_copy(objects: Sequence[bpy.types.Object], name: str) -> bpy.types.Object:
    """Return a new object that Blender has joined of copies of mesh objects, in the collections of the first."""
    return _whole(_copies(objects), objects[0].users_collection, name)


def _copies(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    """Return copies of mesh objects, with meshes of their own."""
    copies = []
    for obj in objects:
        copy = obj.copy()
        copy.data = obj.data.copy()
        copies.append(copy)
    return copies


def _whole(
    copies: Sequence[bpy.types.Object], collections: Sequence[bpy.types.Collection], name: str
) -> bpy.types.Object:
    """Join copies of mesh objects to the first of them, which is put into these collections and gets the name."""
    whole, first = copies[0], bpy.context.scene.collection
    whole.name = name
    for copy in copies:
        first.objects.link(copy)
    bpy.context.view_layer.update()
    for copy in copies:
        if is_mirrored(copy) != is_mirrored(whole):  # Blender joins it inside out
            copy.data.flip_normals()
    spare = [copy.data for copy in copies[1:]]
    with (
        quiet(),
        bpy.context.temp_override(
            active_object=whole, object=whole, selected_objects=copies, selected_editable_objects=copies
        ),
    ):
        bpy.ops.object.join()
    for mesh in spare:
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
    places = [collection for collection in dict.fromkeys(collections) if collection.is_editable]
    for collection in places:
        if whole.name not in collection.objects:
            collection.objects.link(whole)
    if places and first not in places:
        first.objects.unlink(whole)
    return whole


def _written_on_all(objects: Sequence[bpy.types.Object]) -> list[tuple[str, str, str]]:
    """Return which layers earlier transfers wrote, by kind, name and source's name, and no object has as its own."""
    known, own = {}, set()
    for obj in objects:
        written = {(x.kind, x.name): x.source_name for x in unedited(obj)}
        known |= written
        own |= {(row.kind, name) for row in ROWS for name in row.access.names(obj)} - written.keys()
    return [(*layer, source_name) for layer, source_name in known.items() if layer not in own]


def _numbered(mesh: bpy.types.Mesh, domain: str, offsets: dict[str, int]) -> range:
    """Write on each element of a copied mesh which one it is of all objects', and return these numbers."""
    first, number = offsets[domain], len(getattr(mesh, _DOMAINS[domain]))
    offsets[domain] = first + number
    if (stale := mesh.attributes.get(_NUMBER + domain)) is not None:
        mesh.attributes.remove(stale)
    attribute: Any = mesh.attributes.new(_NUMBER + domain, "INT", domain)
    attribute.data.foreach_set("value", np.arange(first, first + number, dtype=np.int32))
    return range(first, first + number)


def _taken_off(mesh: bpy.types.Mesh, domain: str) -> Integers:
    """Return where each element of all objects is in the joined mesh, whose numbers are taken off it."""
    attribute: Any = mesh.attributes[_NUMBER + domain]
    numbers = foreach(attribute.data, "value", 1, np.int32)
    mesh.attributes.remove(attribute)
    place = np.empty(len(numbers), np.intp)
    place[numbers] = np.arange(len(numbers))
    return place


def _directions(obj: bpy.types.Object) -> Floats:
    """Return the matrix, (3, 3), that takes displacements of an object's `Surface` to the world."""
    flip = np.diag([-1.0 if is_mirrored(obj) else 1.0, 1.0, 1.0])
    return np.array(obj.matrix_world.to_3x3(), dtype=np.float64) @ flip
