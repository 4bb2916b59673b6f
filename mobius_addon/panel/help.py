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
    is_there = COLLECTION in context.scene.collection.children
    example, icon = (MOBIUS_OT_remove_example, "TRASH") if is_there else (MOBIUS_OT_load_example, "MONKEY")
    row = beside_or_below(layout, context, MOBIUS_OT_guide.bl_label, example.bl_label)
    row.operator(MOBIUS_OT_guide.bl_idname, icon="HELP")
    if is_there or (settings.source is None and settings.target is None):
        row.operator(example.bl_idname, icon=icon)
