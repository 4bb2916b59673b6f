"""The kinds of files: what Blender reads and writes them with, and how an argument names one."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils

from . import blend, gifti, off, vtk
from .unreadable import Unreadable


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Parameters
    ----------
    importer, exporter : callable
        Read a path into the scene; write the selected objects to a path with a small ending. An importer may return
        the list of objects that the file has; otherwise they are those that are new.
    """

    importer: Callable[[str], object]
    exporter: Callable[[str], object]


def _operator(name: str, module: str | None = None) -> Callable[..., Any]:
    """Return a Blender operator; `module` is the add-on that brings it where Blender itself does not."""
    group, verb = name.split(".")
    operator = getattr(getattr(bpy.ops, group), verb)
    if module is not None and not addon_utils.check(module)[1]:
        addon_utils.enable(module)
    return operator


def _save_blend(path: str) -> None:
    # a copy, whose relative paths Blender adjusts to the folder; compressed if the file that is open is
    compress = _is_compressed(bpy.data.filepath)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, relative_remap=True, compress=compress, check_existing=False)


def _is_compressed(path: str) -> bool:
    if not path:
        return False
    with open(path, "rb") as file:
        return file.read(4) in (b"\x28\xb5\x2f\xfd", b"\x1f\x8b\x08\x00")  # Zstandard, and gzip before Blender 3.0


def _save_gltf(path: str) -> None:
    form = "GLB" if path.endswith(".glb") else "GLTF_SEPARATE"
    _operator("export_scene.gltf", "io_scene_gltf2")(
        filepath=path, use_selection=True, use_active_scene=True, export_format=form
    )


def _import_usd(path: str) -> None:
    small = str(Path(path).with_suffix(Path(path).suffix.lower()))
    if path == small or not path.lower().endswith(".usdz"):
        bpy.ops.wm.usd_import(filepath=path)
        return
    # such a package is known by a small ending only
    with tempfile.TemporaryDirectory(prefix="mobius-") as folder:
        bpy.ops.wm.usd_import(filepath=shutil.copyfile(path, str(Path(folder) / Path(small).name)))


_BLEND = Format(blend.read, _save_blend)
_OBJ = Format(
    lambda path: bpy.ops.wm.obj_import(filepath=path),
    lambda path: bpy.ops.wm.obj_export(
        filepath=path, export_selected_objects=True, apply_modifiers=False, export_colors=True, path_mode="COPY"
    ),
)
_PLY = Format(
    lambda path: bpy.ops.wm.ply_import(filepath=path),
    lambda path: bpy.ops.wm.ply_export(
        filepath=path, export_selected_objects=True, apply_modifiers=False, export_colors="SRGB"
    ),
)
_STL = Format(
    lambda path: bpy.ops.wm.stl_import(filepath=path),
    lambda path: bpy.ops.wm.stl_export(filepath=path, export_selected_objects=True, apply_modifiers=False),
)
_GLTF = Format(
    lambda path: _operator("import_scene.gltf", "io_scene_gltf2")(filepath=path),
    _save_gltf,
)
_FBX = Format(
    lambda path: _operator("import_scene.fbx", "io_scene_fbx")(filepath=path),
    lambda path: _operator("export_scene.fbx", "io_scene_fbx")(
        filepath=path, use_selection=True, use_mesh_modifiers=False, path_mode="COPY"
    ),
)
_USD = Format(
    _import_usd,
    lambda path: bpy.ops.wm.usd_export(filepath=path, selected_objects_only=True),
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
    ".usdz": _USD,
    ".gii": Format(gifti.read, gifti.write),
}

ONE_MESH = frozenset({".ply", ".stl", ".gii"})
"""Endings of those that hold a single mesh."""


@dataclass(frozen=True)
class ReadOnly:
    """A kind of file that is read and not written; see `Format`."""

    importer: Callable[[str], object]


READ_ONLY = {
    ".vrm": ReadOnly(_GLTF.importer),  # a .glb with an avatar's rig described in it
    ".off": ReadOnly(off.read),
    ".vtk": ReadOnly(vtk.read),
}

_OBJECT = re.compile(f"({'|'.join(map(re.escape, [*FORMATS, *READ_ONLY]))})(?P<colon>:)", re.IGNORECASE)
"""Where in FILE:Object the file ends."""


def split_object_name(argument: str) -> tuple[Path, str | None]:
    """Split FILE:Object into the file and the object's name; a file without a name gives None.

    >>> split_object_name("scans.BLEND:Scan.003")
    (PosixPath('scans.BLEND'), 'Scan.003')
    """
    if os.path.lexists(argument):
        return Path(argument), None
    ends = [found.start("colon") for found in _OBJECT.finditer(argument) if argument[found.end("colon") :]]
    if ends:
        end = next((k for k in ends if os.path.lexists(argument[:k])), ends[0])
        return Path(argument[:end]), argument[end + 1 :]
    return Path(argument), None


def format_of(path: Path) -> Format:
    """Return the format that the ending of a file to be written names.

    Raises
    ------
    Unreadable
        No such ending, or one of files that are only read; or what writes it is not installed.
    """
    found = FORMATS.get(path.suffix.lower())
    if found is None and path.suffix.lower() in READ_ONLY:
        raise Unreadable(f"'{path}': {path.suffix} files are read, but not written: use one of {' '.join(FORMATS)}")
    if found is None:
        raise Unreadable(f"'{path}' has an ending that is not known: use one of {' '.join(FORMATS)}")
    if path.suffix.lower() == ".gii":
        gifti.nibabel_gifti(path, "written")  # said before any work
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
    """Return the first message of an importer's or exporter's error; of a traceback in it, what that ends with."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if is_traceback(error):
        # Blender adds where its own operator was called
        named = [line for line in lines if re.match(r"[\w.]*(Error|Exception|Exit|Interrupt)\b", line)]
        return named[-1] if named else lines[-1]
    return lines[0].removeprefix("Error:").strip() if lines else type(error).__name__


def is_traceback(error: Exception) -> bool:
    """Return whether an error of Blender passes on one that an importer or exporter in Python did not expect."""
    return "Traceback (most recent call last)" in str(error)
