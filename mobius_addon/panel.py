"""The panel "Möbius" in the sidebar of the 3D viewport, and the entry in the Object menu."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import overlay, stored_alignment, topology_cache
from .attributes import KINDS
from .heat_maps import MAP_MEASURES
from .jobs import Job, MOBIUS_OT_stop, describe_proof
from .operators.align import MOBIUS_OT_align
from .operators.check import MOBIUS_OT_check
from .operators.clear import MOBIUS_OT_clear
from .operators.conformal_transfer import MOBIUS_OT_conformal_transfer
from .operators.discs import MOBIUS_OT_show_discs
from .operators.flatten import MOBIUS_OT_flatten
from .operators.heat_map import MOBIUS_OT_heat_map
from .operators.select_unmatched import MOBIUS_OT_select_unmatched
from .operators.side_by_side import MOBIUS_OT_end_side_by_side, MOBIUS_OT_side_by_side, is_shown
from .operators.swap import MOBIUS_OT_swap
from .operators.transfer import MOBIUS_OT_transfer
from .options import (
    ALIGN_OPTIONS,
    SCAN_OPTIONS,
    SOURCE_MASK_OPTIONS,
    TRANSFER_OPTIONS,
    draw_transfer,
    enum_identifier,
    repair,
)
from .preferences import preferences
from .preset_menus import MOBIUS_PT_align_presets, MOBIUS_PT_transfer_presets
from .transfer_preview import draw_preview
from .usable import why_not


class MobiusPanel:
    """Where all panels of the extension are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Möbius"


class MobiusSubPanel(MobiusPanel):
    """A part of the main panel that can be folded."""

    bl_parent_id = "MOBIUS_PT_main"


class MOBIUS_PT_main(MobiusPanel, bpy.types.Panel):
    """Choose two meshes and align them."""

    bl_label = "Möbius"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layout, settings = self.layout, context.scene.mobius
        _draw_picker(layout, context, "source")
        row = layout.row()
        row.alignment = "CENTER"
        row.operator(MOBIUS_OT_swap.bl_idname, text="Swap", icon="FILE_REFRESH")
        _draw_picker(layout, context, "target")
        layout.separator()
        if Job.current is not None:
            _draw_job(layout, Job.current)
        else:
            column = layout.column()
            column.scale_y = 1.4
            button = column.operator(MOBIUS_OT_align.bl_idname, icon="MOD_MESHDEFORM")
            _hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)


class MOBIUS_PT_result(MobiusSubPanel, bpy.types.Panel):
    """What the last alignment of the chosen pair found and proved."""

    bl_label = "Result"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is one."""
        return overlay.pair(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the figures."""
        layout, settings = self.layout, context.scene.mobius
        found = stored_alignment.figures(settings.target)
        if found is None:
            layout.label(text="Damaged: press Align again", icon="ERROR")
            return
        column = layout.column(align=True)
        if found["certified"]:
            column.label(text="Certified: none matches more", icon="CHECKMARK")
        elif "rotation" in found and found["rotation"]["upper_bound"] <= found["value"]:
            share = 100 * found["gap"] / max(found["value"], 1e-9)
            said = iface_("No rotation matches more, no other map more than {:.1f} %")
            column.label(text=said.format(share), icon="CHECKMARK", translate=False)
        elif found["rival_taken"]:
            column.label(text=iface_("Not the best match: gap {:.2f}").format(found["gap"]), icon="INFO")
        else:
            column.label(text=iface_("Not certified: gap {:.2f}").format(found["gap"]), icon="ERROR")
        for name, value in _rows(found):
            row = column.split(factor=0.5)
            row.label(text=name)
            row.label(text=value, translate=False)
        _draw_doubts(layout, settings, found)


class MOBIUS_PT_pictures(MobiusSubPanel, bpy.types.Panel):
    """See what the alignment is worth."""

    bl_label = "Show"
    bl_order = 2

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is an alignment."""
        return MOBIUS_PT_result.poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the switches and buttons."""
        layout, view = self.layout, context.window_manager.mobius_view
        column = layout.column()
        column.prop(view, "matches")
        if view.matches:
            row = column.row(align=True)
            row.prop(view, "count")
            row.prop(view, "lines", slider=True)
        column = layout.column(align=True)
        if is_shown(context):
            column.operator(MOBIUS_OT_end_side_by_side.bl_idname, icon="LOOP_BACK", depress=True)
        else:
            column.operator(MOBIUS_OT_side_by_side.bl_idname, icon="MOD_MIRROR")
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
        layout.operator(MOBIUS_OT_clear.bl_idname, icon="TRASH")


class MOBIUS_PT_transfer(MobiusSubPanel, bpy.types.Panel):
    """Carry data from the source to the target."""

    bl_label = "Transfer"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice of data and the button."""
        layout, settings = self.layout, context.scene.mobius
        column = layout.column(align=True)
        column.emboss = "NONE"
        for kind in KINDS:
            identifier = enum_identifier(kind.identifier)
            icon = "CHECKBOX_HLT" if identifier in settings.kinds else "CHECKBOX_DEHLT"
            row = column.row()
            row.alignment = "LEFT"
            row.prop_enum(settings, "kinds", identifier, icon=icon)
        draw_preview(layout, context)
        column = layout.column()
        column.scale_y = 1.4
        _hand_on(TRANSFER_OPTIONS, settings, column.operator(MOBIUS_OT_transfer.bl_idname, icon="MOD_DATA_TRANSFER"))


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
        _hand_on(SOURCE_MASK_OPTIONS, settings, button)
        button.edit = True


class MOBIUS_PT_scans(MobiusSubPanel, bpy.types.Panel):
    """What to do about scans that are no clean discs."""

    bl_label = "Scans"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 4

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
        _hand_on(SCAN_OPTIONS, settings, layout.operator(MOBIUS_OT_flatten.bl_idname, icon="UV"))
        layout.operator(MOBIUS_OT_clear.bl_idname, text="Clear Selected", icon="TRASH").clear_from = "selected"


class MOBIUS_PT_alignment(MobiusSubPanel, bpy.types.Panel):
    """How the search is done."""

    bl_label = "Alignment Settings"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 5

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


def _hand_on(names: Iterable[str], settings: bpy.types.PropertyGroup, operator: bpy.types.OperatorProperties) -> None:
    """Give a button's operator the scene's choices."""
    for name in names:
        setattr(operator, name, getattr(settings, name))


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
        _draw_sentence(column, reason, "ERROR")
        return
    kept = preferences(context)
    if kept is not None and not kept.check_while_drawing:
        line = topology_cache.Line((iface_("{:,} vertices").format(len(obj.data.vertices)),), None, True)
    else:
        line = topology_cache.line_of(obj, repair(settings))
    icon = {True: "CHECKMARK", False: "ERROR", None: "QUESTION"}[line.is_disc]
    row = column.row(align=True)
    texts = row.column(align=True)
    for number, text in enumerate(line.rows):
        texts.label(text=text, icon="BLANK1" if number else icon, translate=False)
    if line.selectable:
        button = row.operator(MOBIUS_OT_check.bl_idname, text="", icon="RESTRICT_SELECT_OFF")
        button.object_name, button.edit = obj.name, True


def _draw_job(layout: bpy.types.UILayout, job: Job) -> None:
    """Draw how far the work under way is, and what it has proved."""
    row = layout.row(align=True)
    row.progress(factor=job.progress.fraction, text=iface_("Waiting") if job.waits else iface_(job.progress.stage))
    row.operator(MOBIUS_OT_stop.bl_idname, text="", icon="X")
    layout.label(text=job.waits or describe_proof(job.progress) or iface_("ESC stops"), translate=False)


def _rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the name and the value of each figure of a report."""
    reflected = found["mobius"]["reflected"]
    rows = [
        (iface_("Matched Points"), iface_("{:,} of {:,}").format(found["matches"], found["samples"])),
        (iface_("Matched Value"), f"{found['value']:.2f}"),
        (iface_("Proven Bound"), f"{found['upper_bound']:.2f}"),
        (iface_("Coverage"), f"{found['coverage']:.0%}"),
        (iface_("Orientation"), iface_("mirrored") if reflected else iface_("not mirrored")),
    ]
    if (margin := found["orientation_margin"]) is not None:
        rows.append((iface_("Not Mirrored") if reflected else iface_("Mirrored"), _behind(margin)))
    if (margin := found["rival_margin"]) is not None:
        # its search ends as soon as it is decided, so that this is only a bound
        rows.append((iface_("Next Rival"), ("≥ " if margin >= 0 else "") + _behind(margin)))
    if (parts := found["overlap"]) is not None:
        rows += [
            (iface_("Shared Source"), f"{parts['source_share']:.0%}"),
            (iface_("Shared Target"), f"{parts['target_share']:.0%}"),
            (iface_("Value There"), iface_("{:.2f} of {:.2f}").format(parts["value"], parts["upper_bound"])),
        ]
    rows.append((iface_("Time"), iface_("{:.1f} s").format(sum(found["seconds"].values()))))
    return rows


def _behind(margin: float) -> str:
    """Say how far another map lies behind the one taken, as a share of the samples."""
    return iface_("{:.1%} behind").format(margin) if margin >= 0 else iface_("{:.1%} ahead").format(-margin)


def _draw_doubts(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, found: dict[str, Any]) -> None:
    """Say where the surfaces do not decide, each with a button that takes the other choice."""
    near, reflected = found["settings"]["reflect_margin"], found["mobius"]["reflected"]
    margin, rival = found["orientation_margin"], found["rival_margin"]
    if margin is not None and margin <= near:
        box = layout.box().column(align=True)
        box.label(text="Ambiguous: mirrored or not?", icon="QUESTION")
        text = iface_("Take Not Mirrored") if reflected else iface_("Take Mirrored")
        button = box.operator(MOBIUS_OT_align.bl_idname, text=text, icon="MOD_MIRROR")
        _hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        button.reflect = "never" if reflected else "always"
    if rival is not None and rival <= near:
        box = layout.box().column(align=True)
        box.label(text="Ambiguous: is it symmetric?", icon="QUESTION")
        taken = found["settings"]["take_rival"]
        text = iface_("Take the Best Again") if taken else iface_("Take the Rival")
        button = box.operator(MOBIUS_OT_align.bl_idname, text=text, icon="FILE_REFRESH")
        _hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        button.take_rival = not taken


def _draw_sentence(layout: bpy.types.UILayout, sentence: str, icon: str) -> None:
    """Draw a sentence that may be too long for one row: what is wrong, then what to do about it."""
    for number, text in enumerate(sentence.split(": ", 1)):
        layout.label(text=text, icon="BLANK1" if number else icon, translate=False)


def _draw_in_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry in Object > Link/Transfer Data."""
    menu.layout.separator()
    menu.layout.operator(MOBIUS_OT_conformal_transfer.bl_idname, icon="MOD_DATA_TRANSFER")


_register, _unregister = bpy.utils.register_classes_factory(
    (
        MOBIUS_PT_main,
        MOBIUS_PT_result,
        MOBIUS_PT_pictures,
        MOBIUS_PT_transfer,
        MOBIUS_PT_transfer_settings,
        MOBIUS_PT_scans,
        MOBIUS_PT_alignment,
    )
)


def register() -> None:
    """Register the panels and the menu's entry."""
    _register()
    bpy.types.VIEW3D_MT_make_links.append(_draw_in_menu)


def unregister() -> None:
    """Undo `register`."""
    bpy.types.VIEW3D_MT_make_links.remove(_draw_in_menu)
    _unregister()
