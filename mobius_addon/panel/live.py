"""Attributes that the target follows, live."""

from __future__ import annotations

import bpy

from .. import stored_alignment
from ..operators.live import MOBIUS_OT_live
from .place import MobiusSubPanel


class MOBIUS_PT_live(MobiusSubPanel, bpy.types.Panel):
    """Have the target follow an attribute of the source."""

    bl_label = "Live"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is an alignment."""
        return stored_alignment.pair(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice and the button."""
        column = self.layout.column(align=True)
        settings = context.scene.mobius
        column.enabled = stored_alignment.why_stale(settings.target, settings.source) is None
        column.prop(settings, "live_attribute", text="")
        column.operator(MOBIUS_OT_live.bl_idname, icon="GEOMETRY_NODES").attribute = settings.live_attribute
