"""The first lines of a result: whether it can be believed, how much matched, and how far off it is to be expected."""

from __future__ import annotations

from typing import Any

import bpy

from ..verdict import LEVELS, verdict_lines
from .place import draw_wrapped


def draw_verdict(layout: bpy.types.UILayout, context: bpy.types.Context, found: dict[str, Any], level: str) -> None:
    """Draw the verdict, a row for each thing."""
    column = layout.column(align=True)
    for number, text in enumerate(verdict_lines(context.scene, context.scene.mobius.source, found, level)):
        draw_wrapped(column, context, text, "BLANK1" if number else LEVELS[level][1])
