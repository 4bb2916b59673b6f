"""Meshes into files, through Blender's own exporters; a command's files appear all together or not at all."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy

from ..mesh_data import Refusal
from ..streams import quiet
from .formats import first_message, format_of


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
        raise Refusal(f"'{path.name}' could not be written: {first_message(error)}") from error


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
