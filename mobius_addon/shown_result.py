"""Views that are set right when undo, redo or deletion takes away what they show side by side, or brings it back.

What a viewport looks at belongs to the window, which undo and redo leave alone, and the copies that it looks at belong
to the file, which they do not: what was undone, redone or deleted is followed one tick later.
"""

from __future__ import annotations

from typing import Any

import bpy

from . import comparison, viewport
from .handlers import unwatch, watch
from .job import Job
from .jobs import redraw
from .operators import side_by_side


def follow() -> None:
    """Look at the copies again that redo brought back, and at everything again where there are none any more."""
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window, screen=window.screen):
            _follow(bpy.context)
    _undone.clear()


def _follow(context: bpy.types.Context) -> None:
    if Job.current is not None or context.mode != "OBJECT":
        return
    whole = comparison.copies(context) is not None and _has_both(context.scene)
    if whole and not viewport.looks_at_some_alone() and _undone:
        side_by_side.look(context)
        viewport.show_colors(context)
    elif not whole and (viewport.looks_at_some_alone() or comparison.is_shown(context)):
        side_by_side.leave(context)
        redraw(context)


_undone: set[str] = set()
"""Whether the tick to come is about undo or redo, which may have brought copies back."""


def _has_both(scene: bpy.types.Scene) -> bool:
    return scene.mobius.source is not None and scene.mobius.target is not None


def _soon() -> None:
    if not bpy.app.background and not bpy.app.timers.is_registered(follow):
        bpy.app.timers.register(follow, first_interval=0.0)


def _on_undo(*_: Any) -> None:
    _undone.add("undo")
    _soon()


def _on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    # deleting is an update of the collection; all else is none of ours
    if depsgraph.id_type_updated("COLLECTION") or depsgraph.id_type_updated("SCENE"):
        found = comparison.COLLECTION in scene.collection.children
        if found or viewport.looks_at_some_alone():
            _soon()


_HANDLERS = (("undo_post", _on_undo), ("redo_post", _on_undo), ("depsgraph_update_post", _on_update))


def register() -> None:
    """Watch for undo, redo and deletion."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Stop watching."""
    unwatch(*_HANDLERS)
    if bpy.app.timers.is_registered(follow):
        bpy.app.timers.unregister(follow)
