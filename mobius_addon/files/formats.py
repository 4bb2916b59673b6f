"""The kinds of files: what Blender reads and writes them with, what they can hold, and how an argument names one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils

from ..attributes import KINDS
from ..mesh_data import Refusal


class Unreadable(Refusal):
    """A file is missing, of an unknown kind or damaged, or does not hold the one mesh that is needed."""


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Parameters
    ----------
    importer, exporter : callable
        Read a path into the scene; write the selected objects to a path.
    keeps : frozenset of str
        The kinds of `attributes.KINDS` that such a file can hold.
    """

    importer: Callable[[str], object]
    exporter: Callable[[str], object]
    keeps: frozenset[str]


def _operator(name: str, module: str | None = None) -> Callable[..., Any]:
    """Return a Blender operator; `module` is the add-on that brings it where Blender itself does not."""
    group, verb = name.split(".")
    operator = getattr(getattr(bpy.ops, group), verb)
    if module is not None and not addon_utils.check(module)[1]:
        addon_utils.enable(module)
    return operator


def _load_blend(path: str) -> None:
    with bpy.data.libraries.load(path) as (stored, wanted):
        wanted.objects = stored.objects
    for obj in wanted.objects:
        bpy.context.scene.collection.objects.link(obj)


def _save_blend(path: str) -> None:
    for obj in set(bpy.data.objects) - set(bpy.context.selected_objects):
        bpy.data.objects.remove(obj)
    bpy.data.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)


def _save_gltf(path: str) -> None:
    form = "GLB" if path.endswith(".glb") else "GLTF_SEPARATE"
    _operator("export_scene.gltf", "io_scene_gltf2")(filepath=path, use_selection=True, export_format=form)


_BLEND = Format(_load_blend, _save_blend, frozenset(kind.identifier for kind in KINDS))
_OBJ = Format(
    lambda path: bpy.ops.wm.obj_import(filepath=path),
    lambda path: bpy.ops.wm.obj_export(
        filepath=path, export_selected_objects=True, apply_modifiers=False, export_colors=True, path_mode="COPY"
    ),
    frozenset({"colors", "uv", "smoothness"}),
)
_PLY = Format(
    lambda path: bpy.ops.wm.ply_import(filepath=path),
    lambda path: bpy.ops.wm.ply_export(
        filepath=path, export_selected_objects=True, apply_modifiers=False, export_colors="SRGB"
    ),
    frozenset({"colors", "uv", "attributes"}),
)
_STL = Format(
    lambda path: bpy.ops.wm.stl_import(filepath=path),
    lambda path: bpy.ops.wm.stl_export(filepath=path, export_selected_objects=True, apply_modifiers=False),
    frozenset(),
)
_GLTF = Format(
    lambda path: _operator("import_scene.gltf", "io_scene_gltf2")(filepath=path),
    _save_gltf,
    frozenset({"colors", "uv"}),
)
_FBX = Format(
    lambda path: _operator("import_scene.fbx", "io_scene_fbx")(filepath=path),
    lambda path: _operator("export_scene.fbx", "io_scene_fbx")(
        filepath=path, use_selection=True, use_mesh_modifiers=False, path_mode="COPY"
    ),
    frozenset({"colors", "uv"}),
)
_USD = Format(
    lambda path: bpy.ops.wm.usd_import(filepath=path),
    lambda path: bpy.ops.wm.usd_export(filepath=path, selected_objects_only=True),
    frozenset({"colors", "uv", "attributes"}),
)

FORMATS = {
    ".blend": _BLEND,
    ".obj": _OBJ,
    ".ply": _PLY,
    ".stl": _STL,
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".fbx": _FBX,
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
}


def split_object_name(argument: str) -> tuple[Path, str | None]:
    """Split FILE:Object into the file and the object's name; a file without a name gives None.

    >>> split_object_name("scans.blend:Scan.003")
    (PosixPath('scans.blend'), 'Scan.003')
    """
    if Path(argument).exists():
        return Path(argument), None
    for ending in FORMATS:
        before, found, name = argument.rpartition(f"{ending}:")
        if found and name:
            return Path(before + ending), name
    return Path(argument), None


def format_of(path: Path) -> Format:
    """Return the format that a path's ending names.

    Raises
    ------
    Unreadable
        No such ending.
    """
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        known = " ".join(FORMATS)
        raise Unreadable(f"'{path}' has an ending that is not known: use one of {known}")
    return found


def first_message(error: Exception) -> str:
    """Return the first message of an importer's error."""
    first = next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)
    return first.removeprefix("Error:").strip()
