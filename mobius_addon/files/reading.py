"""Meshes out of files, through Blender's own importers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

from ..streams import quiet
from .formats import Unreadable, first_message, format_of, split_object_name


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
    """

    path: Path
    name: str
    obj: bpy.types.Object

    def order_change(self) -> str | None:
        """Return why the object's vertices are not numbered as in the file, or None if they are."""
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
        raise Unreadable(f"'{path}' could not be read: {first_message(error)}") from error
    finally:
        found = [Imported(path, obj.name, obj) for obj in bpy.data.objects if obj not in before]
        for imported in found:
            if imported.name in before.values():
                imported.obj.name = f"{imported.name}.001"
        for obj, name in before.items():
            obj.name = name
    bpy.context.view_layer.update()
    meshes = [x for x in found if x.obj.type == "MESH"]
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
