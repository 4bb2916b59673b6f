"""The commands in an installed Blender: `blender --command mobius COMMAND`."""

from __future__ import annotations

from typing import Any

from .program import main_quietly

_handle: Any = None


def register() -> None:
    """Register the commands as `blender --command mobius`."""
    import bpy

    global _handle
    _handle = bpy.utils.register_cli_command(
        "mobius", lambda arguments: main_quietly(list(arguments), "blender --command mobius")
    )


def unregister() -> None:
    """Undo `register`."""
    import bpy

    bpy.utils.unregister_cli_command(_handle)
