"""The kinds of files: what Blender reads and writes them with, what they can hold, and how an argument names one."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils

from ..attributes import KINDS
from . import blend, gifti, off, vtk
from .unreadable import Unreadable


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Parameters
    ----------
    importer, exporter : callable
        Read a path into the scene; write the selected objects to a path. An importer may return the list of objects
        that the file has; otherwise they are those that are new.
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


def _save_blend(path: str) -> None:
    for obj in set(bpy.data.objects) - set(bpy.context.selected_objects):
        bpy.data.objects.remove(obj)
    bpy.data.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)


def _save_gltf(path: str) -> None:
    form = "GLB" if path.endswith(".glb") else "GLTF_SEPARATE"
    _operator("export_scene.gltf", "io_scene_gltf2")(filepath=path, use_selection=True, export_format=form)


_BLEND = Format(blend.read, _save_blend, frozenset(kind.identifier for kind in KINDS))
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


@dataclass(frozen=True)
class ReadOnly:
    """A kind of file that is read and not written; see `Format`."""

    importer: Callable[[str], object]


READ_ONLY = {
    ".vrm": ReadOnly(_GLTF.importer),  # a .glb with an avatar's rig described in it
    ".usdz": ReadOnly(_USD.importer),
    ".off": ReadOnly(off.read),
    ".vtk": ReadOnly(vtk.read),
    ".gii": ReadOnly(gifti.read),
}

_OBJECT = re.compile(f"({'|'.join(map(re.escape, [*FORMATS, *READ_ONLY]))})(?P<colon>:)", re.IGNORECASE)
"""Where in FILE:Object the file ends."""


def split_object_name(argument: str) -> tuple[Path, str | None]:
    """Split FILE:Object into the file and the object's name; a file without a name gives None.

    >>> split_object_name("scans.BLEND:Scan.003")
    (PosixPath('scans.BLEND'), 'Scan.003')
    """
    if not os.path.lexists(argument):
        for found in _OBJECT.finditer(argument):
            before, name = argument[: found.start("colon")], argument[found.end("colon") :]
            if name:
                return Path(before), name
    return Path(argument), None


def format_of(path: Path) -> Format:
    """Return the format that the ending of a file to be written names.

    Raises
    ------
    Unreadable
        No such ending, or one of files that are only read.
    """
    found = FORMATS.get(path.suffix.lower())
    if found is None and path.suffix.lower() in READ_ONLY:
        raise Unreadable(f"'{path}': {path.suffix} files are read, but not written: use one of {' '.join(FORMATS)}")
    if found is None:
        raise Unreadable(f"'{path}' has an ending that is not known: use one of {' '.join(FORMATS)}")
    return found


def reader_of(path: Path) -> Format | ReadOnly:
    """Return what reads a file with a path's ending.

    Raises
    ------
    Unreadable
        No such ending.
    """
    ending = path.suffix.lower()
    found = FORMATS.get(ending) or READ_ONLY.get(ending)
    if found is None:
        known = " ".join([*FORMATS, *READ_ONLY])
        raise Unreadable(f"'{path}' has an ending that is not known: use one of {known}")
    return found


def first_message(error: Exception) -> str:
    """Return the first message of an importer's error; of a traceback that Blender passes on, what it ends with."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if any("Traceback (most recent call last)" in line for line in lines):
        # Blender adds where its own operator was called
        named = [line for line in lines if re.match(r"[\w.]+(Error|Exception|Exit)\b", line)]
        lines = [f"it does not hold what its kind of file does ({named[-1] if named else lines[-1]})"]
    return (lines or [type(error).__name__])[0].removeprefix("Error:").strip()
