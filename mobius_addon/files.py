"""Meshes in and out of files, through Blender's own importers and exporters."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils
import bmesh
import numpy as np

from .attributes import KINDS
from .mesh_data import Refusal, foreach


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
    join : callable
        Mends an imported mesh that such a file holds cut open, and returns how many vertices were joined.
    """

    importer: Callable[[str], object]
    exporter: Callable[[str], object]
    keeps: frozenset[str]
    join: Callable[[bpy.types.Mesh], int] = lambda _mesh: 0


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


def _join_coinciding(mesh: bpy.types.Mesh) -> int:
    """Join vertices at exactly the same place and return how many disappeared.

    Files that store one normal and one UV per vertex repeat vertices along seams and sharp edges; as they stand, the
    surface would be cut open there.
    """
    places = foreach(mesh.vertices, "co", 3, np.float32)
    _, first, place_of = np.unique(places, axis=0, return_index=True, return_inverse=True)
    repeated = np.flatnonzero(first[place_of.ravel()] != np.arange(len(places)))
    if repeated.size:
        edit = bmesh.new()
        edit.from_mesh(mesh)
        edit.verts.ensure_lookup_table()
        kept = first[place_of.ravel()[repeated]]
        pairs = zip(repeated.tolist(), kept.tolist(), strict=True)
        bmesh.ops.weld_verts(edit, targetmap={edit.verts[gone]: edit.verts[stays] for gone, stays in pairs})
        edit.to_mesh(mesh)
        edit.free()
    return int(repeated.size)


def _join_along_seams(mesh: bpy.types.Mesh) -> int:
    """Join coinciding vertices of a mesh with UVs; without them the file had no reason to repeat any."""
    return _join_coinciding(mesh) if mesh.uv_layers else 0


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
    _join_along_seams,
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
    _join_coinciding,
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


def new_scene() -> None:
    """Begin with an empty scene; the person's settings and add-ons stay."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@dataclass(frozen=True)
class Imported:
    """An object from a file.

    Attributes
    ----------
    path : Path
        The file.
    name : str
        The object's name there; the scene's other objects may force another on it.
    obj : bpy.types.Object
        The object.
    joined : int
        Vertices that were joined with others at the very same place.
    """

    path: Path
    name: str
    obj: bpy.types.Object
    joined: int = 0

    def order_change(self) -> str | None:
        """Return why the object's vertices are not numbered as in the file, or None if they are."""
        if self.joined:
            return f"{self.joined:,} that repeat another one's place were joined with it"
        if self.path.suffix.lower() == ".obj":
            with self.path.open("rb") as lines:
                dropped = sum(line.startswith(b"v ") for line in lines) - len(self.obj.data.vertices)
            if dropped:
                return f"Blender leaves out {dropped:,} that no face of this object uses"
        return None


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
    if path.stat().st_size == 0:
        raise Unreadable(f"'{path}' is empty")
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
        found = [Imported(path, obj.name, obj) for obj in bpy.data.objects if obj not in before]
        for imported in found:
            if imported.name in before.values():
                imported.obj.name = f"{imported.name}.001"
        for obj, name in before.items():
            obj.name = name
    bpy.context.view_layer.update()
    meshes = [replace(x, joined=form.join(x.obj.data)) for x in found if x.obj.type == "MESH"]
    if not meshes:
        raise Unreadable(f"'{path}' holds no mesh")
    return sorted(meshes, key=lambda imported: imported.name)


def import_mesh(argument: str) -> Imported:
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
                return imported
        raise Unreadable(f"'{path}' has no mesh object named '{wanted}': it has {listed}")
    if len(meshes) > 1:
        raise Unreadable(f"'{path}' has {len(meshes)} mesh objects ({listed}): name one as {path}:NAME")
    return meshes[0]


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
