"""Tells those who remember something about meshes when a mesh was edited."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from .handlers import unwatch, watch

Forget = Callable[[int | None], None]

_listeners: list[Forget] = []


def listen(forget: Forget) -> None:
    """Have `forget` called with the session uid of each edited mesh, and with None when any may have changed."""
    _listeners.append(forget)


def ignore(forget: Forget) -> None:
    """Undo `listen`."""
    _listeners.remove(forget)


def _on_edit(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    for update in depsgraph.updates:
        if update.is_updated_geometry:
            data = getattr(update.id.original, "data", update.id.original)
            if (uid := getattr(data, "session_uid", None)) is not None:
                for forget in _listeners:
                    forget(uid)


def _on_other_data(*_: object) -> None:
    for forget in _listeners:
        forget(None)


_HANDLERS = (
    ("depsgraph_update_post", _on_edit),
    *((name, _on_other_data) for name in ("load_post", "undo_post", "redo_post")),
)


def register() -> None:
    """Watch for edits."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Stop watching."""
    unwatch(*_HANDLERS)
