"""`check`: what each mesh is, and what will be done about it."""

from __future__ import annotations

import argparse

from ..streams import DONE, NOT_ALIGNED, UNUSABLE, say, say_error
from .mesh_options import MESH_HELP
from .output_files import warn

HELP = "Say what each mesh is, and what will be done about it."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `check` takes."""
    parser.add_argument("meshes", metavar="MESH", nargs="+", help=MESH_HELP)


def run(options: argparse.Namespace) -> int:
    """Say a line about each mesh and return the exit status, the worst of all."""
    from ...solver import MeshError, verdict
    from ...solver.align.cut.held import held
    from ..files import Unreadable, chosen, import_meshes, new_scene, require_places, split_object_name, together
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
                surface = read_surface(imported.obj, name)
                whole = verdict(surface.mesh, keys=surface.keys)
                line = whole.describe()
                if badly := held(whole.tidy):
                    line += f"; {badly.text}"
            except Unreadable as error:
                say_error(f"mobius: {error}")
                status = UNUSABLE
                continue
            except MeshError as error:
                line = "cannot be used: it " + str(error).removeprefix(f"'{name}' ")
                status = max(status, NOT_ALIGNED)
            say(f"{name}: {line}")
        if len(found) > 1:
            try:
                notes = together(found, path, wanted)[1]
            except Unreadable as error:
                notes = [str(error)]
            warn(notes)
    return status
