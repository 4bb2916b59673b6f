"""`check`: what each mesh is, and what will be done about it."""

from __future__ import annotations

import argparse

from ..streams import DONE, NOT_ALIGNED, UNUSABLE, say, say_error
from .mesh_options import MESH_HELP

HELP = "Say what each mesh is, and what will be done about it."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `check` takes."""
    parser.add_argument("meshes", metavar="MESH", nargs="+", help=MESH_HELP)


def run(options: argparse.Namespace) -> int:
    """Say a line about each mesh and return the exit status, the worst of all."""
    from ...solver import MeshError, verdict
    from ..files import Unreadable, import_meshes, new_scene, split_object_name
    from ..mesh_data import read_surface

    status = DONE
    for argument in options.meshes:
        path, wanted = split_object_name(argument)
        new_scene()
        try:
            found = import_meshes(path)
            chosen = [x for x in found if wanted in (None, x.name)]
            if not chosen:
                raise Unreadable(f"'{path}' has no mesh object named '{wanted}'")
        except Unreadable as error:
            say_error(f"mobius: {error}")
            status = UNUSABLE
            continue
        for imported in chosen:
            name = argument if len(chosen) == 1 else f"{path}:{imported.name}"
            try:
                surface = read_surface(imported.obj, name)
                line = verdict(surface.mesh, keys=surface.keys).describe()
            except MeshError as error:
                line = "cannot be used: it " + str(error).removeprefix(f"'{name}' ")
                status = max(status, NOT_ALIGNED)
            say(f"{name}: {line}")
    return status
