"""Where a package that the solver needs cannot be loaded: a panel and a command that say so, in place of the tools."""

from __future__ import annotations

import logging
import sys
import textwrap
from importlib import import_module
from typing import Any

import bpy

NEEDED = (
    "numpy",
    "scipy.linalg",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.sparse.csgraph",
    "scipy.sparse.linalg",
    "scipy.spatial.transform",
)

BROUGHT = [(3, 11), (3, 13), *([(3, 14)] if sys.platform == "linux" else [])]
"""Versions of Python that the zips hold scipy for; the last one for Blenders that Linux distributions build."""

LETTER = 8
"""Width of a letter in pixels, at a scale of 1; rather too wide than cut off."""

log = logging.getLogger(__name__)


def reasons() -> list[str]:
    """Return sentences that say which package cannot be loaded, why, and what to do; none if all can."""
    name = ""
    try:
        for name in NEEDED:
            import_module(name)
    except Exception as error:  # whatever a package made for another Python, numpy or system raises
        package = name.partition(".")[0]
        lines = str(error).strip().splitlines() or [type(error).__name__]
        what_to_do = "Remove Möbius and install the zip that is made for this system"
        if sys.version_info[:2] not in BROUGHT:
            python = ".".join(map(str, sys.version_info[:2]))
            what_to_do = f"Möbius brings it for the Python of Blender's own builds, 3.11 and 3.13, not for {python}"
        return [f"'{package}' cannot be loaded: {lines[0]}", what_to_do]
    return []


class MOBIUS_PT_absent(bpy.types.Panel):
    """Why Möbius cannot work here."""

    bl_label = "Möbius"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Möbius"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the reasons, in lines that the sidebar has room for."""
        column = self.layout.column(align=True)
        column.label(text="Möbius cannot work here", icon="ERROR")
        letters = int(context.region.width / (LETTER * context.preferences.system.ui_scale))
        for reason in reasons():
            for line in textwrap.wrap(reason, max(letters, 16)):
                column.label(text=line)


def refuse(_arguments: list[str]) -> int:
    """Say why no command can run, and return the exit status."""
    sys.stderr.write(f"mobius: {'. '.join(reasons())}.\n")
    return 2


_command: Any = None


def register() -> None:
    """Register the panel and a command `mobius` that refuses."""
    global _command
    bpy.utils.register_class(MOBIUS_PT_absent)
    _command = bpy.utils.register_cli_command("mobius", refuse)
    log.warning("%s.", ". ".join(reasons()))


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_cli_command(_command)
    bpy.utils.unregister_class(MOBIUS_PT_absent)
