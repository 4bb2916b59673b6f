"""Reading .blend files: their own objects, and those that they link from other files."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..mesh_data import Refusal


def read(path: str) -> list[bpy.types.Object]:
    """Put the objects of a .blend file into the scene and return them.

    Its own objects become the scene's. Those that its scenes or collection instances link from other files stay
    linked, so that they can be read, but not written.

    Raises
    ------
    RuntimeError
        Blender cannot read it.
    """
    kept = set(bpy.data.scenes)
    with bpy.data.libraries.load(path) as (stored, wanted):
        wanted.objects = stored.objects
        wanted.scenes = stored.scenes
    found = with_shown(
        [obj for obj in wanted.objects if obj is not None], [scene for scene in wanted.scenes if scene is not None]
    )
    for scene in set(bpy.data.scenes) - kept:
        if scene.library is None:
            bpy.data.scenes.remove(scene)
    there = set(bpy.context.scene.collection.objects)
    for obj in found:
        if obj not in there:
            bpy.context.scene.collection.objects.link(obj)
    return found


def with_shown(own: list[bpy.types.Object], scenes: list[bpy.types.Scene]) -> list[bpy.types.Object]:
    """Return objects of a file, and after them those from other files that its scenes or collection instances show."""
    shown = dict.fromkeys(own)
    for scene in scenes:
        shown |= dict.fromkeys(_with_instances(scene.objects))
    # those of a library that is not there are only stand-ins
    return [obj for obj in shown if obj.library is None or not obj.is_missing]


def missing_libraries() -> list[str]:
    """Return the names of linked files that are not there."""
    return sorted(
        Path(library.filepath).name
        for library in bpy.data.libraries
        if not Path(bpy.path.abspath(library.filepath)).is_file()
    )


def require_local(obj: bpy.types.Object, path: Path) -> None:
    """Raise `Refusal` if an object of a file, or its mesh, is another file's and so cannot be changed.

    An object that overrides a linked one may be the file's own; layers of an overridden mesh are not.

    Parameters
    ----------
    obj : bpy.types.Object
    path : Path
        The file that it was found in.
    """
    override = obj.data.override_library
    for block in (obj, obj.data, override.reference if override is not None else obj.data):
        if block.library is not None:
            origin = block.library.filepath.replace("\\", "/").rpartition("/")[2]
            raise Refusal(
                f"'{obj.name}' in '{path}' is linked from '{origin}' and cannot be changed: make it local first "
                f"(Object > Relations > Make Local > All), or name {origin}:{block.name}"
            )


def _with_instances(objects: bpy.types.bpy_prop_collection) -> list[bpy.types.Object]:
    """Return objects and those in the collections that they are instances of, and so on."""
    found: dict[bpy.types.Object, None] = {}
    waiting = list(objects)
    while waiting:
        obj = waiting.pop()
        if obj not in found:
            found[obj] = None
            if obj.instance_type == "COLLECTION" and obj.instance_collection is not None:
                waiting += obj.instance_collection.all_objects
    return list(found)
