"""Blender's lists of functions that it calls when something happens to a file: entered and taken out in one place.

They outlast the file that is open, which Blender calls persistent.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

Handler = tuple[str, Callable[..., Any]]
"""The name of one of Blender's lists, such as 'save_pre', and what it shall call."""


def watch(*handlers: Handler) -> None:
    """Have each function called by its list, until `unwatch`; a list that this Blender does not have is left out."""
    for name, follows in handlers:
        if (called := getattr(bpy.app.handlers, name, None)) is not None:
            called.append(bpy.app.handlers.persistent(follows))


def unwatch(*handlers: Handler) -> None:
    """Undo `watch`."""
    for name, follows in handlers:
        if (called := getattr(bpy.app.handlers, name, None)) is not None:
            called.remove(follows)
