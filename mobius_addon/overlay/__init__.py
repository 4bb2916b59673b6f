"""Pictures over the editors: matched points and lines between them, the two discs, and the legend of the colors.

Draw handlers exist only while something is to be seen; opening a file and switching the extension off remove them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from .. import edits
from ..handlers import unwatch, watch
from .discs import draw_discs, draw_names
from .legend import draw_legends, legends
from .matches import Matches, draw_matches, matches_of
from .remembered import forget

__all__ = ["Matches", "follow", "legends", "matches_of", "register", "unregister"]

_handles: dict[str, Any] = {}


def follow(context: bpy.types.Context) -> None:
    """Draw what the session's view asks for, and nothing else."""
    view = context.window_manager.mobius_view
    wanted = {"matches": view.matches, "legend": view.legend, "discs": view.discs, "names": view.discs}
    for name, (space, kind, draw) in _PICTURES.items():
        if wanted[name] and name not in _handles:
            _handles[name] = space.draw_handler_add(draw, (), "WINDOW", kind)
        elif not wanted[name] and name in _handles:
            space.draw_handler_remove(_handles.pop(name), "WINDOW")
    if not _handles:
        forget(None)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "IMAGE_EDITOR"):
                area.tag_redraw()


_PICTURES: dict[str, tuple[Any, str, Callable[[], None]]] = {
    "matches": (bpy.types.SpaceView3D, "POST_VIEW", draw_matches),
    "legend": (bpy.types.SpaceView3D, "POST_PIXEL", draw_legends),
    "discs": (bpy.types.SpaceImageEditor, "POST_VIEW", draw_discs),
    "names": (bpy.types.SpaceImageEditor, "POST_PIXEL", draw_names),
}


def _hide_all(*_: object) -> None:
    """Begin a file without pictures."""
    view = bpy.context.window_manager.mobius_view
    view.matches = view.discs = view.legend = False


def register() -> None:
    """Watch for edits and for other files."""
    edits.listen(forget)
    watch(("load_post", _hide_all))


def unregister() -> None:
    """Remove every draw handler."""
    unwatch(("load_post", _hide_all))
    edits.ignore(forget)
    for name in list(_handles):
        _PICTURES[name][0].draw_handler_remove(_handles.pop(name), "WINDOW")
    forget(None)
