"""What was made to be drawn, kept until a mesh is edited or a choice is another one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy


@dataclass(frozen=True, eq=False)
class _Picture:
    """Something to draw, with the meshes (session uids) and the choices it was made from."""

    meshes: tuple[int, ...]
    made_for: tuple[int, ...]
    content: Any


# a cache, never the truth: it can be emptied at any time
_remembered: dict[str, _Picture] = {}


def remember(
    kind: str, objects: tuple[bpy.types.Object, ...], made_for: tuple[int, ...], make: Callable[[], Any]
) -> Any:
    """Return what `make` returned, until an object or a choice is another one or a mesh was edited."""
    meshes = tuple(obj.data.session_uid for obj in objects)
    known = _remembered.get(kind)
    if known is None or (known.meshes, known.made_for) != (meshes, made_for):
        if any(obj.mode == "EDIT" for obj in objects):  # its mesh cannot be read
            return None
        known = _remembered[kind] = _Picture(meshes, made_for, make())
    return known.content


def forget(edited: int | None) -> None:
    """Forget what was made from a mesh, given by its session uid; None: everything."""
    for kind in [kind for kind, known in _remembered.items() if edited is None or edited in known.meshes]:
        del _remembered[kind]
