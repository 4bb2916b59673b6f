"""Files that commands write: refused before any work where they cannot be, and what is to be said of them."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..streams import say_error

if TYPE_CHECKING:
    from ..files import Imported


def add_output_options(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add where a mesh file goes, and whether it may take an input's place."""
    parser.add_argument("-o", "--output", metavar="OUT", type=Path, required=True, help=help_text)
    parser.add_argument(
        "--overwrite",
        action="store_true",
        help="allow OUT to be a file that is read; of a .blend the old one stays as .blend1",
    )


def require_writable(
    meshes: Iterable[Path] = (),
    others: Iterable[Path | None] = (),
    *,
    inputs: Iterable[Path | str | None] = (),
    overwrite: bool = False,
) -> None:
    """Make sure, before any work, that outputs can be written and take no input's place.

    Parameters
    ----------
    meshes, others : iterable of Path
        Mesh files, and other files, to write.
    inputs : iterable of Path or str
        Files that are read; a str may name an object in one.
    overwrite : bool
        A mesh file may be an input.

    Raises
    ------
    Unreadable
        One cannot be written.
    """
    from ..files import Unreadable, format_of, real_place, require_folder, require_place, split_object_name

    meshes, others = list(meshes), [path for path in others if path is not None]
    read = {real_place(split_object_name(x)[0] if isinstance(x, str) else x) for x in inputs if x is not None}
    for path in meshes:
        format_of(path)
    for path in [*meshes, *others]:
        require_place(path)
        place = real_place(path)
        if place in read and path in others:
            raise Unreadable(f"'{path}' is read by this command: name another file to write")
        if place in read and not overwrite:
            raise Unreadable(f"'{path}' is read by this command: name another file, or say --overwrite")
    if len({real_place(path) for path in [*meshes, *others]}) < len(meshes) + len(others):
        raise Unreadable("two outputs have the same name")
    for folder in {real_place(path).parent for path in [*meshes, *others]}:
        require_folder(folder)


def write_report(path: Path, figures: dict[str, Any]) -> None:
    """Write figures as JSON that everyone reads: no NaN, no infinity."""
    text = json.dumps(figures, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    path.write_text(text, encoding="utf-8", errors="backslashreplace")  # of a file's name that is no UTF-8


def is_input(output: Path, inputs: Iterable[str]) -> bool:
    """Return whether an output takes the place of a file that FILE or FILE:OBJECT names."""
    from ..files import real_place, split_object_name

    return real_place(output) in {real_place(split_object_name(x)[0]) for x in inputs}


def orders(map_path: Path | None, meshes: Iterable[Imported | None]) -> list[str]:
    """Return sentences on where a map to be written does not count a file's vertices as the file does."""
    found = [(imported.path, imported.order_change()) for imported in meshes if imported is not None and map_path]
    return [f"the map counts the vertices of '{path}' otherwise: {reason}" for path, reason in found if reason]


def warn(sentences: Iterable[str]) -> None:
    """Say sentences as warnings."""
    for sentence in sentences:
        say_error(f"mobius: warning: {sentence}")
