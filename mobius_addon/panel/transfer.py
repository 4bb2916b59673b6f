"""What is carried, how it joins what is there, and the button."""

from __future__ import annotations

import bpy

from .. import stored_alignment
from ..job import Job
from ..operators.select_unmatched import MOBIUS_OT_select_unmatched
from ..operators.transfer import MOBIUS_OT_transfer
from ..options import SOURCE_MASK_OPTIONS, TRANSFER_OPTIONS, draw_kinds, draw_transfer
from ..preset_menus import MOBIUS_PT_transfer_presets
from ..transfer_preview import draw_preview
from .place import MobiusPanel, MobiusSubPanel, draw_refused, hand_on


class MOBIUS_PT_transfer(MobiusSubPanel, bpy.types.Panel):
    """Carry data from the source to the target."""

    bl_label = "Transfer"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice of data and the button."""
        layout, settings = self.layout, context.scene.mobius
        draw_preview(layout, context)
        column = layout.column()
        column.scale_y = 1.4
        # targets that are selected tell by themselves what is stale
        pair = stored_alignment.pair(context) if settings.carry_to == "target" else None
        column.enabled = pair is None or stored_alignment.why_stale(pair[1], pair[0]) is None
        draw_kinds(layout, settings, settings.source)
        hand_on(TRANSFER_OPTIONS, settings, column.operator(MOBIUS_OT_transfer.bl_idname, icon="MOD_DATA_TRANSFER"))
        if Job.refused is not None and Job.refused.title == MOBIUS_OT_transfer.job_title:
            draw_refused(layout, context)


class MOBIUS_PT_transfer_settings(MobiusPanel, bpy.types.Panel):
    """What of the chosen kinds is carried, how it joins what is there, and where."""

    bl_label = "Transfer Settings"
    bl_parent_id = "MOBIUS_PT_transfer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the menu of presets."""
        MOBIUS_PT_transfer_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout, settings = self.layout, context.scene.mobius
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "carry_to")
        draw_transfer(layout, settings)
        button = layout.operator(MOBIUS_OT_select_unmatched.bl_idname, icon="RESTRICT_SELECT_OFF")
        hand_on(SOURCE_MASK_OPTIONS, settings, button)
        button.edit = True
