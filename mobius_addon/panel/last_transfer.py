"""What the last transfer to the chosen target has written, layer by layer, and what was left out."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import last_transfer
from ..attributes import KINDS
from ..last_transfer import LastTransfer, LayerWritten
from ..operators.try_expressions import MOBIUS_OT_try_expressions
from ..playing import Play
from ..translation import told
from .place import MobiusPanel, draw_wrapped

_NAMES = 8
"""So many layers of a kind have a row of their own."""


class MOBIUS_PT_last_transfer(MobiusPanel, bpy.types.Panel):
    """What the last transfer to the chosen target has written."""

    bl_label = "Last Transfer"
    bl_parent_id = "MOBIUS_PT_transfer"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there was one."""
        return _found(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the layers, kind by kind, and what was left out."""
        layout, found = self.layout, _found(context)
        if found is None:
            return
        draw_wrapped(layout.column(align=True), context, iface_("From '{}'").format(found.source), "CHECKMARK")
        if any(layer.kind == "shape-keys" for layer in found.layers):
            layout.operator(MOBIUS_OT_try_expressions.bl_idname, icon="PLAY", depress=Play.current is not None)
        for kind in KINDS:
            layers = [layer for layer in found.layers if layer.kind == kind.identifier]
            if layers:
                _draw_kind(layout, iface_(kind.label), layers)
        if found.uncertain:
            text = iface_("{:.1%} of the area is uncertain").format(found.uncertain)
            draw_wrapped(layout.column(align=True), context, text, "QUESTION")
        for sentence in found.warnings:
            draw_wrapped(layout.column(align=True), context, told(sentence), "ERROR")


def _found(context: bpy.types.Context) -> LastTransfer | None:
    target = context.scene.mobius.target
    return last_transfer.of_mesh(target.data) if target is not None and target.type == "MESH" else None


def _draw_kind(layout: bpy.types.UILayout, label: str, layers: list[LayerWritten]) -> None:
    """Draw how many layers of a kind were written, and each under the name it has, with its share if not whole."""
    column = layout.column(align=True)
    column.label(text=f"{label}: {len(layers)}", translate=False)
    for layer in layers[:_NAMES]:
        text = layer.name if layer.name == layer.source_name else f"{layer.source_name} → {layer.name}"
        row = column.row()
        row.label(text=text, icon="DOT", translate=False)
        if layer.share < 1:
            row.label(text=f"{layer.share:.0%}", translate=False)
    if len(layers) > _NAMES:
        text = iface_("and {:,} more").format(len(layers) - _NAMES)
        column.label(text=text, icon="BLANK1", translate=False)
