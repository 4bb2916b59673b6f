"""Point pairs that correct the map of the chosen pair."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import point_pairs
from ..operators.align import MOBIUS_OT_align
from ..operators.point_pairs import (
    MOBIUS_OT_add_pair,
    MOBIUS_OT_bend_through_pairs,
    MOBIUS_OT_remove_pair,
    MOBIUS_OT_select_pair,
)
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS
from .place import AlignedPanel, hand_on


class MOBIUS_PT_pairs(AlignedPanel, bpy.types.Panel):
    """Correct the map by pairs of points."""

    bl_label = "Correct by Point Pairs"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the pairs, each with what became of it, and what can be done about them."""
        layout, settings = self.layout, context.scene.mobius
        layout.operator(MOBIUS_OT_add_pair.bl_idname, icon="ADD")
        pairs = point_pairs.listed(settings.source, settings.target)
        column = layout.column(align=True)
        for pair in pairs:
            row = column.row(align=True)
            icon = {True: "CHECKMARK", False: "ERROR", None: "FILE_REFRESH"}[pair.followed]
            off = "" if pair.missed is None else f"   {pair.missed:.1%}"
            button = row.operator(MOBIUS_OT_select_pair.bl_idname, text=pair.name + off, icon=icon, translate=False)
            button.pair = pair.name
            row.operator(MOBIUS_OT_remove_pair.bl_idname, text="", icon="X").pair = pair.name
        out = sum(pair.followed is False for pair in pairs)
        if out:
            box = layout.box().column(align=True)
            box.label(text=iface_("Outvoted: the map is surer ({:,})").format(out), icon="ERROR", translate=False)
            button = box.operator(MOBIUS_OT_bend_through_pairs.bl_idname, text="Follow All", icon="CHECKMARK")
            button.follow_all = True
            if 2 * out > len(pairs):  # then the map is wrong as a whole, rather than here and there
                button = box.operator(MOBIUS_OT_align.bl_idname, text="Align Again by the Pairs", icon="MOD_MESHDEFORM")
                hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
                button.landmarks = "empties"
        if not point_pairs.are_applied(settings.source, settings.target):
            layout.operator(MOBIUS_OT_bend_through_pairs.bl_idname, icon="FILE_REFRESH")
