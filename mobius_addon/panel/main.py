"""The panel's top: two meshes and the button that aligns them, or the work under way."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import topology_cache
from ..job import Job, describe_left, describe_proof
from ..jobs import MOBIUS_OT_stop
from ..operators.align import MOBIUS_OT_align
from ..operators.align_selected import MOBIUS_OT_align_selected, selected_targets
from ..operators.check import MOBIUS_OT_check
from ..operators.join_copy import MOBIUS_OT_join_copy, selected_with
from ..operators.swap import MOBIUS_OT_swap
from ..operators.transfer import MOBIUS_OT_transfer
from ..operators.use_selected import MOBIUS_OT_use_selected
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS, repair
from ..preferences import preferences
from ..translation import told
from ..usable import is_read_only, why_not, why_not_written
from .help import draw_help
from .mending import draw_menu, draw_remedies
from .place import MobiusPanel, beside_or_below, draw_refused, draw_sentence, draw_wrapped, hand_on


class MOBIUS_PT_main(MobiusPanel, bpy.types.Panel):
    """Choose two meshes and align them."""

    bl_label = "Möbius"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layout, settings = self.layout, context.scene.mobius
        _draw_picker(layout, context, "source")
        row = beside_or_below(layout, context, "Swap", MOBIUS_OT_use_selected.bl_label)
        row.operator(MOBIUS_OT_swap.bl_idname, text="Swap", icon="FILE_REFRESH")
        row.operator(MOBIUS_OT_use_selected.bl_idname, icon="RESTRICT_SELECT_OFF")
        _draw_picker(layout, context, "target")
        layout.separator()
        if Job.current is not None:
            _draw_job(layout, Job.current)
        else:
            column = layout.column()
            column.scale_y = 1.4
            button = column.operator(MOBIUS_OT_align.bl_idname, icon="MOD_MESHDEFORM")
            hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
            if Job.refused is not None and Job.refused.title != MOBIUS_OT_transfer.job_title:
                draw_refused(layout, context)
            # with another target chosen the selected meshes are what is to be joined
            several = len(selected_targets(context)) > 1 and not (settings.target and selected_with(context, "source"))
            if settings.source is not None and several:
                button = layout.operator(MOBIUS_OT_align_selected.bl_idname, icon="CON_FOLLOWTRACK")
                hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        draw_help(layout, context)


def _draw_picker(layout: bpy.types.UILayout, context: bpy.types.Context, role: str) -> None:
    """Draw the choice of a mesh, and under it what that mesh is, with a button that selects what is wrong with it."""
    settings = context.scene.mobius
    obj = getattr(settings, role)
    column = layout.column(align=True)
    column.label(text=iface_("Source") if role == "source" else iface_("Target"), translate=False)
    column.prop(settings, role, text="", icon="OUTLINER_OB_MESH")
    if obj is None:
        return
    if reason := why_not(obj, f"{role} mesh", context.scene, writes=False):
        draw_sentence(column, context, reason, "ERROR")
        return
    kept = preferences(context)
    if kept is not None and not kept.check_while_drawing:
        line = topology_cache.Line((iface_("{:,} vertices").format(len(obj.data.vertices)),), None, True)
    else:
        line = topology_cache.line_of(obj, repair(settings))
    icon = {True: "CHECKMARK", False: "ERROR", None: "QUESTION"}[line.is_disc]
    row = column.row(align=True)
    texts = row.column(align=True)
    buttons = bool(line.selectable) + bool(line.edits)
    for number, text in enumerate(line.rows):
        draw_wrapped(texts, context, text, "BLANK1" if number else icon, buttons=buttons)
    if line.selectable:
        button = row.operator(MOBIUS_OT_check.bl_idname, text="", icon="RESTRICT_SELECT_OFF")
        button.object_name, button.edit = obj.name, True
    draw_menu(row, obj, line)
    if line.remedy:
        column.prop(settings, line.remedy, toggle=True)
    draw_remedies(column, obj, line)
    if others := selected_with(context, role):
        text = iface_("Join a Copy of {:,} Selected").format(len(others) + 1)
        column.operator(MOBIUS_OT_join_copy.bl_idname, text=text, icon="AUTOMERGE_ON", translate=False).role = role
    if role == "source" and is_read_only(obj):
        text = iface_("'{}' is linked from another file: Align only reads it, and writes on the target alone")
        draw_sentence(column, context, text.format(obj.name), "LOCKED")
    elif reason := why_not_written(obj):
        draw_sentence(column, context, reason, "LOCKED")


def _draw_job(layout: bpy.types.UILayout, job: Job) -> None:
    """Draw how far the work under way is, and what it has proved."""
    row = layout.row(align=True)
    row.progress(factor=job.progress.fraction, text=iface_("Waiting") if job.waits else told(job.progress.stage))
    row.operator(MOBIUS_OT_stop.bl_idname, text="", icon="X")
    # always two rows, so that what is below stays where it is
    layout.label(text=job.waits or describe_left(job) or iface_("ESC stops"), translate=False)
    layout.label(text=describe_proof(job.progress), translate=False)
