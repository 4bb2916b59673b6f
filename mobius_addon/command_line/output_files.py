"""Files that commands write: refused before any work where they cannot be, and what they cannot hold said after it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..streams import say_error

if TYPE_CHECKING:
    from ..files import Imported


def require_writable(meshes: Iterable[Path] = (), others: Iterable[Path | None] = ()) -> None:
    """Raise `Unreadable` before any work if an output cannot be written."""
    from ..files import Unreadable, format_of

    meshes, others = list(meshes), [path for path in others if path is not None]
    for path in meshes:
        format_of(path)
    for path in [*meshes, *others]:
        if path.is_dir():
            raise Unreadable(f"'{path}' is a folder: name a file to write")
        if not path.resolve().parent.is_dir():
            raise Unreadable(f"there is no folder '{path.parent}' to write '{path.name}' in")
    if len({path.resolve() for path in [*meshes, *others]}) < len(meshes) + len(others):
        raise Unreadable("two outputs have the same name")


def write_report(path: Path, figures: dict[str, Any]) -> None:
    """Write figures as JSON that everyone reads: no NaN, no infinity."""
    path.write_text(json.dumps(figures, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def warn_of_losses(path: Path, kinds: Iterable[str]) -> None:
    """Say what a file of this kind cannot hold."""
    from ..attributes import KINDS
    from ..files import format_of

    nouns = {kind.identifier: kind.noun for kind in KINDS}
    lost = [nouns[kind] for kind in kinds if kind not in format_of(path).keeps]
    if lost:
        say_error(f"mobius: warning: {path.suffix} files cannot hold {', '.join(lost)}: write a .blend to keep them")


def warn_of_order(map_path: Path | None, meshes: Iterable[Imported]) -> None:
    """Say where the map that was written does not count a file's vertices as the file does."""
    for imported in meshes if map_path else ():
        if reason := imported.order_change():
            say_error(f"mobius: warning: the map counts the vertices of '{imported.path}' otherwise: {reason}")
