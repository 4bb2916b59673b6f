"""Attributes that the target follows, live."""

from __future__ import annotations

import bpy

from ..operators.live import MOBIUS_OT_live
from .place import AlignedPanel, is_current


class MOBIUS_PT_live(AlignedPanel, bpy.types.Panel):
    """Have the target follow an attribute of the source."""

    bl_label = "Live"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice and the button."""
        column = self.layout.column(align=True)
        settings = context.scene.mobius
        column.enabled = is_current(context)
        column.prop(settings, "live_attribute", text="")
        column.operator(MOBIUS_OT_live.bl_idname, icon="GEOMETRY_NODES").attribute = settings.live_attribute
