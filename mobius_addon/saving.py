"""A file that is saved while source and target are shown side by side: it is saved as if they were not.

The copies are never written. What was selected, and what viewports look at, is put back for the moment of saving, and
then is again as the person has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from . import comparison, viewport


@dataclass(frozen=True)
class _Shown:
    """What was selected in a window's view layer, and what its viewports looked at, by name."""

    selected: tuple[str, ...]
    active: str
    views: viewport.Away


# from the beginning of saving to its end, by scene and view layer
_shown: dict[tuple[str, str], _Shown] = {}


@bpy.app.handlers.persistent
def _on_save(*_: Any) -> None:
    _shown.clear()
    comparison.leave_out()
    for context in _windows():
        layer = context.view_layer
        if not comparison.is_shown(context):
            continue
        # in other modes what is selected stays: it is what is edited
        selected = tuple(obj.name for obj in layer.objects if obj.select_get())
        active = layer.objects.active.name if layer.objects.active is not None else ""
        views = viewport.put_away(context)
        if context.mode == "OBJECT":
            comparison.select_as_before(context)
        _shown[context.scene.name, layer.name] = _Shown(selected, active, views)


@bpy.app.handlers.persistent
def _on_saved(*_: Any) -> None:
    for context in _windows():
        objects = context.view_layer.objects
        shown = _shown.pop((context.scene.name, context.view_layer.name), None)
        if shown is None:
            continue
        found = comparison.copies(context) or ()
        if context.mode == "OBJECT":
            for obj in objects:  # a viewport can look alone at what is selected only
                obj.select_set(obj in found)
        viewport.put_back(context, shown.views, found)
        if context.mode == "OBJECT":
            for obj in objects:
                obj.select_set(obj.name in shown.selected)
            objects.active = objects.get(shown.active)


def _windows() -> Any:
    """Yield the context of every window."""
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window, screen=window.screen):
            yield bpy.context


def _watched() -> tuple[tuple[list[Any], Any], ...]:
    handlers = bpy.app.handlers
    return (
        (handlers.save_pre, _on_save),
        (handlers.save_post, _on_saved),
        (handlers.save_post_fail, _on_saved),
    )


def register() -> None:
    """Watch for the file being saved."""
    for handlers, follows in _watched():
        handlers.append(follows)


def unregister() -> None:
    """Stop watching."""
    for handlers, follows in _watched():
        handlers.remove(follows)
