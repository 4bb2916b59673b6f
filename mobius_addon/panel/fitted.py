"""The fitted shape: one of the meshes in the shape of the other, as a new object."""

from __future__ import annotations

import bpy

from ..operators.wrap import MOBIUS_OT_wrap
from .place import AlignedPanel, is_current


class MOBIUS_PT_fitted(AlignedPanel, bpy.types.Panel):
    """Bend one mesh into the shape of the other, as a new object."""

    bl_label = "Fitted Shape"
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        """Draw a button for either way."""
        column = self.layout.column(align=True)
        column.enabled = is_current(context)
        column.operator(MOBIUS_OT_wrap.bl_idname, text="Source onto Target", icon="MOD_SHRINKWRAP").fitted = "source"
        column.operator(MOBIUS_OT_wrap.bl_idname, text="Target as Source", icon="SHAPEKEY_DATA").fitted = "target"
