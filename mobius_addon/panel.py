"""The panel "Möbius" in the sidebar of the 3D viewport."""

from collections.abc import Iterable

import bpy

from . import stored_alignment, topology_cache
from .operators.align import MOBIUS_OT_align
from .operators.check import MOBIUS_OT_check
from .operators.flatten import MOBIUS_OT_flatten
from .operators.transfer import MOBIUS_OT_transfer
from .options import ALIGN_OPTIONS, SCAN_OPTIONS, TRANSFER_OPTIONS, repair
from .preferences import preferences
from .usable import why_not


class MobiusPanel:
    """Where all panels of the extension are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Möbius"


class MOBIUS_PT_main(MobiusPanel, bpy.types.Panel):
    """Choose two meshes, align them, carry data from one to the other."""

    bl_label = "Möbius"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layout, settings = self.layout, context.scene.mobius
        for role in ("source", "target"):
            column = layout.column(align=True)
            column.prop(settings, role)
            _draw_line(column, context, getattr(settings, role), role)

        job = context.window_manager.mobius_job
        if job.running:
            layout.progress(factor=job.fraction, text=job.text)
            if job.proved:
                layout.label(text=job.proved)
            layout.label(text="ESC stops", icon="INFO")
        else:
            operator = layout.operator(MOBIUS_OT_align.bl_idname, icon="MOD_MESHDEFORM")
            _hand_on(ALIGN_OPTIONS, settings, operator)
            _hand_on(SCAN_OPTIONS, settings, operator)
        if settings.source and settings.target and settings.target.type == "MESH":
            _draw_result(layout, settings)

        layout.separator()
        layout.column(align=True).prop(settings, "kinds")
        operator = layout.operator(MOBIUS_OT_transfer.bl_idname, icon="MOD_DATA_TRANSFER")
        _hand_on(TRANSFER_OPTIONS, settings, operator)
        layout.separator()
        _hand_on(SCAN_OPTIONS, settings, layout.operator(MOBIUS_OT_flatten.bl_idname, icon="UV"))


class MOBIUS_PT_scans(MobiusPanel, bpy.types.Panel):
    """What to do about scans that are no clean discs."""

    bl_label = "Scans"
    bl_parent_id = "MOBIUS_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout, settings = self.layout, context.scene.mobius
        layout.use_property_split = True
        layout.prop(settings, "fill_holes")
        row = layout.row()
        row.enabled = settings.fill_holes
        row.prop(settings, "outer_loop")
        layout.prop(settings, "largest_part")


class MOBIUS_PT_alignment(MobiusPanel, bpy.types.Panel):
    """How the search is done."""

    bl_label = "Alignment Settings"
    bl_parent_id = "MOBIUS_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout = self.layout
        layout.use_property_split = True
        for name in ALIGN_OPTIONS:
            layout.prop(context.scene.mobius, name)


def _hand_on(names: Iterable[str], settings: bpy.types.PropertyGroup, operator: bpy.types.OperatorProperties) -> None:
    """Give a button's operator the scene's choices."""
    for name in names:
        setattr(operator, name, getattr(settings, name))


def _draw_line(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object | None, role: str) -> None:
    """Say under a picker what the chosen mesh is, with a button that selects what is wrong with it."""
    if obj is None:
        return
    if reason := why_not(obj, f"{role} mesh", context.scene, writes=False):
        layout.label(text=reason, icon="ERROR")
        return
    kept = preferences(context)
    if kept is not None and not kept.check_while_drawing:
        line = topology_cache.Line((f"{len(obj.data.vertices):,} vertices",), None)
    else:
        line = topology_cache.line_of(obj, repair(context.scene.mobius))
    icon = {True: "CHECKMARK", False: "ERROR", None: "QUESTION"}[line.is_disc]
    row = layout.row(align=True)
    row.label(text=line.rows[0], icon=icon)
    if not line.is_disc:
        row.operator(MOBIUS_OT_check.bl_idname, text="", icon="RESTRICT_SELECT_OFF").object_name = obj.name
    for text in line.rows[1:]:
        layout.label(text=text, icon="BLANK1")


def _draw_result(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """Say what the last alignment of the chosen pair found and proved."""
    if not stored_alignment.exists(settings.target, settings.source):
        return
    kept = settings.target.data.mobius_alignment
    box = layout.box().column(align=True)
    gap = kept.upper_bound - kept.value
    proof = "certified" if kept.certified else f"gap {gap:.2f}"
    box.label(text=f"Matched {kept.value:.2f}, bound {kept.upper_bound:.2f}: {proof}")
    mirrored = ", mirrored" if kept.reflected else ""
    box.label(text=f"{kept.coverage:.0%} of the vertices{mirrored}, {kept.seconds:.1f} s")


register, unregister = bpy.utils.register_classes_factory((MOBIUS_PT_main, MOBIUS_PT_scans, MOBIUS_PT_alignment))
