"""Tells those who remember something about meshes when a mesh was edited."""

from __future__ import annotations

from collections.abc import Callable

import bpy

Forget = Callable[[int | None], None]

_listeners: list[Forget] = []


def listen(forget: Forget) -> None:
    """Have `forget` called with the session uid of each edited mesh, and with None when any may have changed."""
    _listeners.append(forget)


def ignore(forget: Forget) -> None:
    """Undo `listen`."""
    _listeners.remove(forget)


@bpy.app.handlers.persistent
def _on_edit(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    for update in depsgraph.updates:
        if update.is_updated_geometry:
            data = getattr(update.id.original, "data", update.id.original)
            if (uid := getattr(data, "session_uid", None)) is not None:
                for forget in _listeners:
                    forget(uid)


@bpy.app.handlers.persistent
def _on_other_data(*_: object) -> None:
    for forget in _listeners:
        forget(None)


def _all_data_changes() -> tuple[list[Callable[..., None]], ...]:
    handlers = bpy.app.handlers
    return handlers.load_post, handlers.undo_post, handlers.redo_post


def register() -> None:
    """Watch for edits."""
    bpy.app.handlers.depsgraph_update_post.append(_on_edit)
    for handlers in _all_data_changes():
        handlers.append(_on_other_data)


def unregister() -> None:
    """Stop watching."""
    bpy.app.handlers.depsgraph_update_post.remove(_on_edit)
    for handlers in _all_data_changes():
        handlers.remove(_on_other_data)
