"""How the options of a transfer are drawn, in the panel and in the redo panel."""

from __future__ import annotations

from typing import Any

import bpy

from .transfer import enum_identifier


def draw_transfer(layout: bpy.types.UILayout, options: Any) -> None:
    """Draw what of the chosen kinds is carried, how it joins what is there, and where."""
    column = layout.column()
    column.prop(options, "layers")
    if options.layers == "named":
        column.prop(options, "layer_names")
    column.prop(options, "collisions")
    column = layout.column()
    column.prop(options, "mix")
    column.prop(options, "mix_factor", text="Factor")
    column = layout.column()
    for role in ("source_mask", "target_mask"):
        row = column.row(align=True)
        row.prop(options, role)
        if getattr(options, role) != "none":
            row.prop(options, f"{role}_invert", text="", icon="ARROW_LEFTRIGHT")
        if getattr(options, role) == "named":
            column.prop(options, f"{role}_name", text=" ")
    column.prop(options, "unmatched")
    column = layout.column(heading="Vertex Groups")
    column.prop(options, "deform_only")
    column.prop(options, "normalize")
    column.prop(options, "limit")
    column.prop(options, "smallest_weight")
    column.prop(options, "rig")
    column = layout.column(heading="Shape Keys")
    column.prop(options, "keys_by")
    column.prop(options, "contacts")
    column.prop(options, "spelling")
    column.prop(options, "halves")
    column.prop(options, "symmetric")
    layout.column(heading="Source").prop(options, "evaluated", text="As Evaluated")
    if enum_identifier("textures") in options.kinds:
        column = layout.column(heading="Textures")
        column.prop(options, "texture_mask")
        for name in ("texture_size", "texture_layout", "texture_margin", "texture_result"):
            column.prop(options, name)
