"""A file that is saved while source and target are shown side by side: it is saved as if they were not.

The copies are never written. What was selected, and what viewports look at, is put back for the moment of saving, and
then is again as the person has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from . import comparison, viewport
from .handlers import unwatch, watch


@dataclass(frozen=True)
class _Selection:
    """What is selected in a view layer, and what is active, by name."""

    selected: tuple[str, ...]
    active: str

    @staticmethod
    def of(layer: bpy.types.ViewLayer) -> _Selection:
        active = layer.objects.active
        selected = tuple(obj.name for obj in layer.objects if obj.select_get())
        return _Selection(selected, active.name if active is not None else "")

    def restore(self, layer: bpy.types.ViewLayer) -> None:
        for obj in layer.objects:
            obj.select_set(obj.name in self.selected)
        layer.objects.active = layer.objects.get(self.active)


# from the beginning of saving to its end: by scene and view layer, which several windows may show, and of all viewports
_selections: dict[tuple[str, str], _Selection] = {}
_views: list[viewport.Away] = []


def _on_save(*_: Any) -> None:
    _selections.clear()
    _views.clear()
    comparison.leave_out()
    for context in _windows():
        # in other modes what is selected stays: it is what is edited
        if comparison.is_shown(context) and context.mode == "OBJECT":
            _selections.setdefault(_key(context), _Selection.of(context.view_layer))
    _views.append(viewport.put_away(bpy.context))
    for context in _windows():
        if _key(context) in _selections:
            comparison.select_as_before(context)


def _on_saved(*_: Any) -> None:
    copies = [obj for scene in bpy.data.scenes for obj in comparison.of_scene(scene)]
    for context in _windows():
        if _key(context) in _selections:  # a viewport can look alone at what is selected only
            for obj in context.view_layer.objects:
                obj.select_set(obj in copies)
    for views in _views:
        viewport.put_back(bpy.context, views, copies)
    for context in _windows():
        if found := _selections.get(_key(context)):
            found.restore(context.view_layer)
    _selections.clear()
    _views.clear()


def _key(context: bpy.types.Context) -> tuple[str, str]:
    return context.scene.name, context.view_layer.name


def _windows() -> Any:
    """Yield the context of every window."""
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window, screen=window.screen):
            yield bpy.context


_HANDLERS = (("save_pre", _on_save), ("save_post", _on_saved), ("save_post_fail", _on_saved))


def register() -> None:
    """Watch for the file being saved."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Stop watching."""
    unwatch(*_HANDLERS)
