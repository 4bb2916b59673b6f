"""Meshes out of files, through Blender's own importers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.surface.mesh import Floats
from ..mesh_data import foreach, mirrored
from ..streams import quiet, reading
from .blend import missing_libraries
from .formats import first_message, is_traceback, reader_of, split_object_name
from .headers import require_sound
from .unreadable import Unreadable, no_numbers

if TYPE_CHECKING:
    from ..joined import Member


def new_scene() -> None:
    """Begin with an empty scene; the person's settings and add-ons stay."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


_Y_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""Turns glTF's coordinates, whose y points up, to Blender's, as Blender's importer turns vertices and objects."""


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
    members : tuple of Member
        The objects that it was joined of, to be written in its place; none for an object of the file itself.
    """

    path: Path
    name: str
    obj: bpy.types.Object
    members: tuple[Member, ...] = ()

    @property
    def objects(self) -> list[bpy.types.Object]:
        """The file's own objects that this is."""
        return [member.obj for member in self.members] or [self.obj]

    def order_change(self) -> str | None:
        """Return why the object's vertices are not numbered as in the file, or None if they are."""
        if self.members:
            names = ", ".join(f"'{obj.name}'" for obj in self.objects)
            return f"those of {names} one after another"
        if self.path.suffix.lower() == ".obj":
            with self.path.open("rb") as lines:
                dropped = sum(line.startswith(b"v ") for line in lines) - len(self.obj.data.vertices)
            if dropped:
                return f"Blender leaves out {dropped:,} that no face of this object uses"
        return None

    def readings(self, points: Floats) -> list[tuple[str, Floats]]:
        """Return what points in a file beside this one, (l, 3), may mean, in the coordinates of the object's `Surface`.

        First, the coordinates that the file keeps for this mesh; then those of the scene that the file places it in,
        and those that Blender gives that scene.
        """
        turned = points @ _Y_UP.T if self.path.suffix.lower() in (".glb", ".gltf", ".vrm") else points
        world = np.array(self.obj.matrix_world.inverted_safe(), dtype=np.float64)
        found = [("the mesh's own coordinates", turned)]
        for what, placed in (("places in the file's scene", turned), ("places as Blender shows the file", points)):
            found.append((what, placed @ world[:3, :3].T + world[:3, 3]))
        return [(what, mirrored(self.obj, placed)) for what, placed in found]


def import_meshes(path: Path) -> list[Imported]:
    """Import a file into the scene and return its mesh objects, in alphabetical order; shapes of bones are none.

    Raises
    ------
    Unreadable
        The file is missing, not a mesh file or damaged, or holds no mesh.
    """
    form = reader_of(path)
    require_readable(path)
    with reading(path):
        return scans(path, _import(path, form.importer))


def _import(path: Path, importer: Callable[[str], object]) -> list[Imported]:
    """Return all objects of a file, which bear their names there unless the scene's others have these."""
    # set the scene's names aside, so that imported objects keep theirs; linked ones have names of their own
    before = {obj: obj.name for obj in bpy.data.objects}
    local = {obj: name for obj, name in before.items() if obj.library is None}
    for number, obj in enumerate(local):
        obj.name = f".mobius-{number}"
    objects: list[bpy.types.Object] = []
    try:
        with quiet():
            listed = importer(str(path.resolve()))
        objects = listed if isinstance(listed, list) else [obj for obj in bpy.data.objects if obj not in before]
    except Unreadable as error:
        raise Unreadable(str(error).replace(str(path.resolve()), str(path))) from error
    except Exception as error:  # whatever a reader meets in a damaged file
        raise Unreadable(f"'{path}' could not be read: {_why(error)}") from error
    finally:
        found = [Imported(path, obj.name, obj) for obj in objects]
        given = set(local.values())
        twins = [x for x in found if x.obj.library is None and x.name in given]
        for number, imported in enumerate(twins):
            imported.obj.name = f".mobius-twin-{number}"
        for obj, name in local.items():
            obj.name = name
        for imported in twins:
            imported.obj.name = imported.name  # Blender adds a number
    bpy.context.view_layer.update()
    return found


def _why(error: Exception) -> str:
    """Return why a reader failed."""
    message = first_message(error)
    return f"it does not hold what its kind of file does ({message})" if is_traceback(error) else message


def require_readable(path: Path) -> None:
    """Raise `Unreadable` if there is no file, or nothing in it, or it is not sound; see `headers.require_sound`."""
    try:
        if not path.is_file():
            raise Unreadable(f"'{path}' is not a file" if path.exists() else f"there is no file '{path}'")
        with path.open("rb") as file:
            if not file.read(1):
                raise Unreadable(f"'{path}' is empty")
    except OSError as error:
        raise Unreadable(f"'{path}' cannot be read: {error.strerror}") from error
    require_sound(path)


def scans(path: Path, found: list[Imported]) -> list[Imported]:
    """Return the mesh objects of a file, in alphabetical order, without the shapes that bones are drawn with.

    Of a linked object with the name of one of the file's own, the own is meant.

    Raises
    ------
    Unreadable
        There is none.
    """
    shapes = {
        bone.custom_shape
        for imported in found
        if imported.obj.type == "ARMATURE" and imported.obj.pose is not None
        for bone in imported.obj.pose.bones
    }
    meshes: dict[str, Imported] = {}
    for imported in sorted(found, key=lambda x: (x.name, x.obj.library is not None)):
        if imported.obj.type == "MESH" and imported.obj not in shapes:
            meshes.setdefault(imported.name, imported)
    if not any(len(x.obj.data.vertices) for x in meshes.values()):
        raise Unreadable(f"'{path}' holds no mesh{_what_is_missing()}")
    return list(meshes.values())


def _what_is_missing() -> str:
    """Return which linked files are not there, to be added to a sentence about what was not found."""
    names = missing_libraries()
    return f"; it links {', '.join(map(repr, names))}, which cannot be found" if names else ""


def import_mesh(argument: str) -> Imported:
    """Import the one mesh that FILE or FILE:Object names.

    Raises
    ------
    Unreadable
        As `import_meshes` and `choose`.
    """
    path, wanted = split_object_name(argument)
    return choose(import_meshes(path), path, wanted)


def choose(meshes: list[Imported], path: Path, wanted: str | None) -> Imported:
    """Return the one of a file's meshes that is named; without a name its only one, or its only one not linked.

    Raises
    ------
    Unreadable
        It is not there, or there are several and none is named, or its vertices are at no place.
    """
    found = meant(meshes, path, wanted)
    if len(found) > 1:
        raise Unreadable(
            f"'{path}' has {len(found)} mesh objects ({listed(found)}): name one as {path}:NAME, "
            "or join them in Blender (Ctrl J) to have all of them at once"
        )
    require_places(found[0])
    return found[0]


def meant(meshes: list[Imported], path: Path, wanted: str | None) -> list[Imported]:
    """Return the mesh that is named; without a name all, of which one that alone is not linked is meant alone."""
    found = chosen(meshes, path, wanted)
    own = [x for x in found if x.obj.library is None]
    return own if len(own) == 1 else found


def chosen(meshes: list[Imported], path: Path, wanted: str | None) -> list[Imported]:
    """Return the one mesh of a file that has a name; all without it.

    Raises
    ------
    Unreadable
        None has it.
    """
    if wanted is None:
        return meshes
    for imported in meshes:
        if imported.name == wanted:
            return [imported]
    missing = _what_is_missing()
    raise Unreadable(f"'{path}' has no mesh object named '{wanted}': it has {listed(meshes)}{missing}")


def listed(meshes: list[Imported]) -> str:
    """Return the first names of meshes, to be told."""
    return ", ".join(f"'{imported.name}'" for imported in meshes[:8]) + (", ..." if len(meshes) > 8 else "")


def require_places(imported: Imported) -> None:
    """Raise `Unreadable` if a vertex is at no place."""
    places = foreach(imported.obj.data.vertices, "co", 3, np.float32)
    if (wrong := np.flatnonzero(~np.isfinite(places).all(axis=1))).size:
        raise no_numbers(imported.path, wrong.size, f"vertex {wrong[0]:,} of '{imported.name}'")
