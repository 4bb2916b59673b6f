"""Meshes in and out of files, through Blender's own importers and exporters."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils

from .mesh_data import Refusal


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


def _load_gltf(path: str) -> None:
    # a glTF file repeats a vertex for each of its normals and UVs, which would cut the surface open
    _operator("import_scene.gltf", "io_scene_gltf2")(filepath=path, merge_vertices=True)


def _save_gltf(path: str) -> None:
    form = "GLB" if path.endswith(".glb") else "GLTF_SEPARATE"
    _operator("export_scene.gltf", "io_scene_gltf2")(filepath=path, use_selection=True, export_format=form)


_BLEND = Format(_load_blend, _save_blend, frozenset({"vertex-groups", "colors", "uv", "attributes"}))
_OBJ = Format(
    lambda path: bpy.ops.wm.obj_import(filepath=path),
    lambda path: bpy.ops.wm.obj_export(
        filepath=path, export_selected_objects=True, apply_modifiers=False, export_colors=True, path_mode="COPY"
    ),
    frozenset({"colors", "uv"}),
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
_GLTF = Format(_load_gltf, _save_gltf, frozenset({"colors", "uv"}))
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


def new_scene() -> None:
    """Begin with an empty scene; the person's settings and add-ons stay."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@dataclass(frozen=True)
class Imported:
    """An object from a file, with the name that it has there (the scene's other objects may force another on it)."""

    name: str
    obj: bpy.types.Object


def import_meshes(path: Path) -> list[Imported]:
    """Import a file into the scene and return its mesh objects, in alphabetical order.

    Raises
    ------
    Unreadable
        The file is missing, not a mesh file or damaged, or holds no mesh.
    """
    form = format_of(path)
    if not path.is_file():
        raise Unreadable(f"'{path}' is not a file" if path.exists() else f"there is no file '{path}'")
    # set the scene's names aside, so that imported objects keep theirs
    before = {obj: obj.name for obj in bpy.data.objects}
    for number, obj in enumerate(before):
        obj.name = f".mobius-{number}"
    try:
        with quiet():
            form.importer(str(path.resolve()))
    except (RuntimeError, OSError) as error:
        raise Unreadable(f"'{path}' could not be read: {_reason(error)}") from error
    finally:
        found = [Imported(obj.name, obj) for obj in bpy.data.objects if obj not in before]
        for imported in found:
            if imported.name in before.values():
                imported.obj.name = f"{imported.name}.001"
        for obj, name in before.items():
            obj.name = name
    bpy.context.view_layer.update()
    meshes = [imported for imported in found if imported.obj.type == "MESH"]
    if not meshes:
        raise Unreadable(f"'{path}' holds no mesh")
    return sorted(meshes, key=lambda imported: imported.name)


def import_mesh(argument: str) -> bpy.types.Object:
    """Import the one mesh that FILE or FILE:Object names.

    Raises
    ------
    Unreadable
        As `import_meshes`; or the object is not there, or the file has several and none is named.
    """
    path, wanted = split_object_name(argument)
    meshes = import_meshes(path)
    listed = ", ".join(f"'{imported.name}'" for imported in meshes[:8]) + (", ..." if len(meshes) > 8 else "")
    if wanted is not None:
        for imported in meshes:
            if imported.name == wanted:
                return imported.obj
        raise Unreadable(f"'{path}' has no mesh object named '{wanted}': it has {listed}")
    if len(meshes) > 1:
        raise Unreadable(f"'{path}' has {len(meshes)} mesh objects ({listed}): name one as {path}:NAME")
    return meshes[0].obj


def export_mesh(obj: bpy.types.Object, path: Path) -> None:
    """Write one object to a file.

    Raises
    ------
    Refusal
        The exporter failed.
    """
    for other in bpy.context.scene.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    try:
        with quiet():
            format_of(path).exporter(str(path.resolve()))
    except (RuntimeError, OSError) as error:
        raise Refusal(f"'{path.name}' could not be written: {_reason(error)}") from error


class Outputs:
    """Files that appear all together, complete, or not at all.

    Each is written under its own name in a hidden folder beside its place and moved when everything has succeeded.
    """

    def __init__(self, folders: ExitStack) -> None:
        self._folders = folders
        self._temporary: dict[Path, Path] = {}

    def path(self, final: Path) -> Path:
        """Return where to write what is to become `final`."""
        parent = final.resolve().parent
        if parent not in self._temporary:
            folder = tempfile.TemporaryDirectory(dir=parent, prefix=".mobius-")
            self._temporary[parent] = Path(self._folders.enter_context(folder))
        return self._temporary[parent] / final.name

    def publish(self) -> None:
        """Move everything that was written to its place, with what an exporter put beside it."""
        for parent, folder in self._temporary.items():
            for written in sorted(folder.iterdir()):
                written.replace(parent / written.name)


@contextmanager
def outputs() -> Iterator[Outputs]:
    """Collect the output files of a command; an exception leaves none of them behind."""
    with ExitStack() as folders:
        collected = Outputs(folders)
        yield collected
        collected.publish()


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what Python importers print to themselves."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        yield


def _reason(error: Exception) -> str:
    """Return the first message of an importer's error."""
    first = next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)
    return first.removeprefix("Error:").strip()
