"""Pictures of what the alignment is worth, and what takes them away."""

from __future__ import annotations

import bpy

from ..heat_maps import MAP_MEASURES
from ..operators.clear import MOBIUS_OT_clear
from ..operators.discs import MOBIUS_OT_show_discs
from ..operators.heat_map import MOBIUS_OT_heat_map
from ..preferences import preferences
from .place import AlignedPanel, is_current


class MOBIUS_PT_pictures(AlignedPanel, bpy.types.Panel):
    """See what the alignment is worth."""

    bl_label = "Show"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the switches and buttons."""
        layout, view = self.layout, context.window_manager.mobius_view
        layout.enabled = is_current(context)
        column = layout.column()
        column.prop(view, "matches")
        if view.matches:
            row = column.row(align=True)
            row.prop(view, "count")
            row.prop(view, "lines", slider=True)
        column = layout.column(align=True)
        if view.discs:
            column.prop(view, "discs", text="Discs in UV Editor", icon="UV", toggle=True)
        else:
            column.operator(MOBIUS_OT_show_discs.bl_idname, icon="UV")
        column = layout.column(align=True)
        column.label(text="Heat Map on Target")
        row = column.row(align=True)
        for measure in MAP_MEASURES:
            row.operator(MOBIUS_OT_heat_map.bl_idname, text=measure.label).measure = measure.identifier
        layout.prop(view, "legend")
        if (kept := preferences(context)) is not None:
            column = layout.column(align=True)
            column.label(text="After Align")
            column.prop(kept, "after_align", text="")
        layout.operator(MOBIUS_OT_clear.bl_idname, icon="TRASH")
