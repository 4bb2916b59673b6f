"""`check`: what each mesh is, and what would make it a disc."""

from __future__ import annotations

import argparse

from ..streams import DONE, NOT_ALIGNED, UNUSABLE, say, say_error
from .mesh_options import MESH_HELP

HELP = "Say what each mesh is, and what would make it a disc."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `check` takes."""
    parser.add_argument("meshes", metavar="MESH", nargs="+", help=MESH_HELP)


def run(options: argparse.Namespace) -> int:
    """Say a line about each mesh and return the exit status, the worst of all."""
    from ...solver import MeshError, topology
    from ..files import Unreadable, chosen, import_meshes, new_scene, require_places, split_object_name
    from ..mesh_data import read_surface

    status = DONE
    for argument in options.meshes:
        path, wanted = split_object_name(argument)
        new_scene()
        try:
            found = chosen(import_meshes(path), path, wanted)
        except Unreadable as error:
            say_error(f"mobius: {error}")
            status = UNUSABLE
            continue
        for imported in found:
            name = argument if len(found) == 1 else f"{path}:{imported.name}"
            try:
                require_places(imported)
                what = topology(read_surface(imported.obj, name).mesh)
                line, is_disc = what.describe(), what.is_disc
            except MeshError as error:
                line, is_disc = "not a disc: it " + str(error).removeprefix(f"'{name}' "), False
            except Unreadable as error:
                say_error(f"mobius: {error}")
                status = UNUSABLE
                continue
            say(f"{name}: {line}")
            if not is_disc:
                status = max(status, NOT_ALIGNED)
    return status
