"""How scans are mended and how the search is done."""

from __future__ import annotations

import bpy

from ..operators.clear import MOBIUS_OT_clear
from ..operators.flatten import MOBIUS_OT_flatten
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS
from ..preferences import preferences
from ..preset_menus import MOBIUS_PT_align_presets
from .place import MobiusSubPanel, hand_on


class MOBIUS_PT_scans(MobiusSubPanel, bpy.types.Panel):
    """What to do about scans that are no clean discs."""

    bl_label = "Scans"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 5

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout, settings = self.layout, context.scene.mobius
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "fill_holes")
        row = layout.row()
        row.active = settings.fill_holes
        row.prop(settings, "outer_loop")
        layout.prop(settings, "largest_part")
        hand_on(SCAN_OPTIONS, settings, layout.operator(MOBIUS_OT_flatten.bl_idname, icon="UV"))
        layout.operator(MOBIUS_OT_clear.bl_idname, text="Clear Selected", icon="TRASH").clear_from = "selected"


class MOBIUS_PT_alignment(MobiusSubPanel, bpy.types.Panel):
    """How the search is done."""

    bl_label = "Alignment Settings"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 6

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the menu of presets."""
        MOBIUS_PT_align_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in ALIGN_OPTIONS:
            layout.prop(context.scene.mobius, name)
        kept = preferences(context)
        if kept is not None:
            layout.prop(kept, "time_limit")
