"""Whether the last alignment of the chosen pair can be believed, what speaks against it, and what to do about that."""

from __future__ import annotations

import bpy

from .. import stored_alignment
from ..comparison import is_shown
from ..operators.align import MOBIUS_OT_align
from ..operators.side_by_side import MOBIUS_OT_end_side_by_side, MOBIUS_OT_side_by_side
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS
from ..verdict import judgement_of
from .place import AlignedPanel, draw_wrapped, hand_on
from .remedies import draw_concerns
from .verdict import draw_verdict


class MOBIUS_PT_result(AlignedPanel, bpy.types.Panel):
    """Whether the last alignment of the chosen pair can be believed."""

    bl_label = "Result"
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the verdict, and every warning with its remedy."""
        layout, settings = self.layout, context.scene.mobius
        found = stored_alignment.figures(settings.target)
        if found is None:
            layout.label(text="Damaged: press Align again", icon="ERROR")
            return
        stale = stored_alignment.why_stale(settings.target, settings.source)
        if stale:
            box = layout.box().column(align=True)
            draw_wrapped(box, context, stale, "ERROR")
            button = box.operator(MOBIUS_OT_align.bl_idname, text="Align Again", icon="FILE_REFRESH")
            hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        judgement = judgement_of(found)
        column = layout.column()
        column.enabled = not stale
        draw_verdict(column, context, found, judgement.level)
        if is_shown(context):
            layout.operator(MOBIUS_OT_end_side_by_side.bl_idname, icon="LOOP_BACK", depress=True)
        else:
            column.operator(MOBIUS_OT_side_by_side.bl_idname, icon="MOD_MIRROR")
        if not stale:
            draw_concerns(layout, context, found, judgement)
