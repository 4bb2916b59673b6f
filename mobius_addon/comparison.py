"""Copies of source and target beside each other: what of Side by Side belongs to the file."""

from __future__ import annotations

from typing import Any

import bpy

from .textures.marks import is_preview_of, leave_out_preview, remove_preview

COLLECTION = "Mobius Side by Side"

_ROLE = "mobius_role"
"""Custom property of a copy: "source" or "target"."""


def is_copy(obj: bpy.types.Object) -> bool:
    """Return whether an object is one of the copies, which nobody should work on."""
    return _ROLE in obj


def users_of(mesh: bpy.types.Mesh) -> int:
    """Return how many use a mesh, beyond copies that are only looked at."""
    collection = bpy.data.collections.get(COLLECTION)
    return mesh.users - sum(obj.data == mesh for obj in (collection.objects if collection is not None else ()))


def remember_selection(context: bpy.types.Context) -> None:
    """Keep which objects are selected and active, by name, in the collection of the comparison."""
    collection = context.scene.collection.children[COLLECTION]
    active = context.view_layer.objects.active
    collection["selected"] = [obj.name for obj in context.view_layer.objects if obj.select_get() and not is_copy(obj)]
    collection["active"] = "" if active is None or is_copy(active) else active.name


def select_as_before(context: bpy.types.Context) -> None:
    """Select what was selected before the copies were, of what is still there."""
    collection, objects = context.scene.collection.children[COLLECTION], context.view_layer.objects
    names = [name for name in collection.get("selected", ()) if name in objects]
    active = collection.get("active", "")
    for obj in objects:
        obj.select_set(obj.name in names)
    objects.active = objects.get(active)


def is_shown(context: bpy.types.Context) -> bool:
    """Return whether the scene holds a comparison, whole or what is left of one."""
    return COLLECTION in context.scene.collection.children


def copies(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object] | None:
    """Return the copies of source and target that the scene shows, None if it does not show both."""
    found = {obj[_ROLE]: obj for obj in of_scene(context.scene)}
    return (found["source"], found["target"]) if found.keys() >= {"source", "target"} else None


def of_scene(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the copies that a scene shows."""
    collection = scene.collection.children.get(COLLECTION)
    return [obj for obj in collection.objects if is_copy(obj)] if collection is not None else []


def end(context: bpy.types.Context) -> None:
    """Remove the copies, if there are any; the meshes stay."""
    if is_shown(context):
        select_as_before(context)
        _remove(context.scene.collection.children[COLLECTION])


def end_for(mesh: bpy.types.Mesh) -> bool:
    """Remove the copies from every scene that shows this mesh side by side, and return whether there were any."""
    shown = [scene.collection.children.get(COLLECTION) for scene in bpy.data.scenes]
    found = {x for x in shown if x is not None and x.is_editable and any(_shows(obj, mesh) for obj in x.objects)}
    for collection in found:
        _remove(collection)
    return bool(found)


def _shows(copy: bpy.types.Object, mesh: bpy.types.Mesh) -> bool:
    return copy.data == mesh or is_preview_of(copy.data, mesh.name)


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
    leave_out()


def leave_out() -> None:
    """Have Blender leave the copies out when it saves the file, with their collection and what a preview has made.

    It asks for that at each save too: it is not known what a person has done with them since.
    """
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None or not collection.is_editable:
        return
    _give_back(collection)
    collection.is_runtime_data = True
    for obj in collection.objects:
        obj.is_runtime_data = True
        leave_out_preview(obj.data)


def _give_back(collection: bpy.types.Collection) -> None:
    """Put what a person has added to the collection of the comparison into the collections of its scenes."""
    for obj in [obj for obj in collection.objects if not is_copy(obj)]:
        for scene in bpy.data.scenes:
            if COLLECTION in scene.collection.children and obj.name not in scene.collection.objects:
                scene.collection.objects.link(obj)
        collection.objects.unlink(obj)


def _remove(collection: bpy.types.Collection) -> None:
    _give_back(collection)
    for obj in list(collection.objects):
        mesh = obj.data
        bpy.data.objects.remove(obj)
        remove_preview(mesh)
    bpy.data.collections.remove(collection)
