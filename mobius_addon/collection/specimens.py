"""The specimens of a collection: files and folders, each read when it is needed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from ...solver.collection import Specimen
from ...solver.collection.folder import free_name
from ...solver.surface.mesh import Floats, MeshError, TriangleMesh
from ..files import FORMATS, READ_ONLY, Unreadable, import_mesh, new_scene, split_object_name
from ..mesh_data import read_surface


def specimens(arguments: Iterable[str], output: Path) -> list[Specimen]:
    """Return the specimens that FILE, FILE:OBJECT and FOLDER name; of a folder all mesh files right in it.

    `output`: the folder of the results, which are none themselves.

    Raises
    ------
    Unreadable
        There is no such file, or a folder without any mesh file; two would have one name; one lies among the results.
    """
    found: dict[str, Specimen] = {}
    said: dict[str, str] = {}
    for argument in _files(arguments):
        path, wanted = split_object_name(argument)
        if not path.is_file():
            raise Unreadable(f"there is no file '{path}'")
        if path.resolve().parent == output.resolve():
            raise Unreadable(f"'{path}' lies where the results go, '{output}': choose another folder for one of them")
        name = free_name(path.stem if wanted is None else f"{path.stem} {wanted}")
        if name.casefold() in said:
            raise Unreadable(f"'{said[name.casefold()]}' and '{argument}' would both be called '{name}': rename one")
        said[name.casefold()] = argument
        found[name] = Specimen(name, _stamp(path, wanted), _Reading(argument, name))
    return list(found.values())


def _files(arguments: Iterable[str]) -> list[str]:
    found: list[str] = []
    for argument in arguments:
        folder = Path(argument)
        if not folder.is_dir():
            found.append(argument)
            continue
        inside = sorted(str(x) for x in folder.iterdir() if x.suffix.lower() in (*FORMATS, *READ_ONLY) and x.is_file())
        if not inside:
            raise Unreadable(f"the folder '{folder}' holds no mesh file")
        found += inside
    return found


def _stamp(path: Path, wanted: str | None) -> str:
    """Return a text that changes with what is in a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:32] + (f":{wanted}" if wanted else "")


class _Reading:
    """Reads a specimen through Blender, in the mesh's own coordinates."""

    def __init__(self, argument: str, name: str) -> None:
        self.argument, self.name = argument, name

    def __call__(self) -> tuple[TriangleMesh, Floats | None]:
        new_scene()
        try:
            surface = read_surface(import_mesh(self.argument).obj, self.name)
        except Unreadable as error:
            raise MeshError(str(error)) from error
        return surface.mesh, surface.keys
