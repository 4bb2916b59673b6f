"""For whoever begins: the guide, and an example to try it on."""

from __future__ import annotations

import bpy

from ..operators.example import (
    COLLECTION,
    MOBIUS_OT_guide,
    MOBIUS_OT_load_example,
    MOBIUS_OT_remove_example,
)
from .place import beside_or_below


def draw_help(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the guide's button, and that of the example while nothing is chosen or it is there."""
    settings = context.scene.mobius
    row = beside_or_below(layout, context)
    row.operator(MOBIUS_OT_guide.bl_idname, icon="HELP")
    if COLLECTION in context.scene.collection.children:
        row.operator(MOBIUS_OT_remove_example.bl_idname, icon="TRASH")
    elif settings.source is None and settings.target is None:
        row.operator(MOBIUS_OT_load_example.bl_idname, icon="MONKEY")
