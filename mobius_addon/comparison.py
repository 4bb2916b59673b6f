"""Copies of source and target beside each other: what of Side by Side belongs to the file."""

from __future__ import annotations

from typing import Any

import bpy

COLLECTION = "Mobius Side by Side"

_ROLE = "mobius_role"
"""Custom property of a copy: "source" or "target"."""


def is_shown(context: bpy.types.Context) -> bool:
    """Return whether the scene holds a comparison, whole or what is left of one."""
    return COLLECTION in context.scene.collection.children


def copies(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object] | None:
    """Return the copies of source and target that the scene shows, None if it does not show both."""
    collection = context.scene.collection.children.get(COLLECTION)
    found = {obj.get(_ROLE): obj for obj in collection.objects} if collection is not None else {}
    return (found["source"], found["target"]) if found.keys() >= {"source", "target"} else None


def end(context: bpy.types.Context) -> None:
    """Remove the copies, if there are any; the meshes stay."""
    if is_shown(context):
        _remove(context.scene.collection.children[COLLECTION])


def end_for(mesh: bpy.types.Mesh) -> bool:
    """Remove the copies from every scene that shows this mesh side by side, and return whether there were any."""
    shown = [scene.collection.children.get(COLLECTION) for scene in bpy.data.scenes]
    found = {x for x in shown if x is not None and x.is_editable and any(obj.data == mesh for obj in x.objects)}
    for collection in found:
        _remove(collection)
    return bool(found)


def add(context: bpy.types.Context, obj: bpy.types.Object, role: str, name: str, matrix: Any) -> None:
    """Put an object with the mesh of another into the collection of the comparison, as its "source" or "target"."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
    if not is_shown(context):
        context.scene.collection.children.link(collection)
    copy = bpy.data.objects.new(name, obj.data)
    copy[_ROLE] = role
    copy.matrix_world = matrix
    copy.show_only_shape_key, copy.active_shape_key_index = obj.show_only_shape_key, obj.active_shape_key_index
    collection.objects.link(copy)


def _remove(collection: bpy.types.Collection) -> None:
    for obj in list(collection.objects):
        bpy.data.objects.remove(obj)
    bpy.data.collections.remove(collection)
