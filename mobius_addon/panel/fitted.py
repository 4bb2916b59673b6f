"""The fitted shape: one of the meshes in the shape of the other, as a new object."""

from __future__ import annotations

import bpy

from .. import stored_alignment
from ..operators.wrap import MOBIUS_OT_wrap
from .place import MobiusSubPanel


class MOBIUS_PT_fitted(MobiusSubPanel, bpy.types.Panel):
    """Bend one mesh into the shape of the other, as a new object."""

    bl_label = "Fitted Shape"
    bl_order = 4

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is an alignment."""
        return stored_alignment.pair(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw a button for either way."""
        column = self.layout.column(align=True)
        settings = context.scene.mobius
        column.enabled = stored_alignment.why_stale(settings.target, settings.source) is None
        column.operator(MOBIUS_OT_wrap.bl_idname, text="Source onto Target", icon="MOD_SHRINKWRAP").fitted = "source"
        column.operator(MOBIUS_OT_wrap.bl_idname, text="Target as Source", icon="SHAPEKEY_DATA").fitted = "target"
