"""The lines above the Transfer button: what of the target's own stays beside what is carried, and what is replaced."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import stored_alignment
from .attributes import preview
from .options import transfer_settings
from .usable import why_not, why_not_two

_NAMES = 4
"""So many fit into a line."""


def draw_preview(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Say which layers of the target's own, or of all targets, a transfer will leave and which it will replace."""
    settings, scene = context.scene.mobius, context.scene
    source, targets = settings.source, [settings.target]
    if settings.carry_to == "selected":
        targets = [x for x in context.selected_objects if x.type == "MESH" and stored_alignment.exists(x, source)]
    if why_not(source, "source mesh", scene, writes=False):
        return
    targets = [x for x in targets if not why_not(x, "target mesh", scene) and not why_not_two(source, x)]
    chosen = transfer_settings(settings)
    met = [preview(source, target, chosen) for target in targets]
    stays = [name for each in met for name in each.kept]
    goes = [name for each in met for name in (*each.replaced, *(iface_(kind) for kind in each.kinds))]
    column = layout.column(align=True)
    for text, names, icon in (
        (iface_("Stays on the target: {}"), list(dict.fromkeys(stays)), "INFO"),
        (iface_("Replaced on the target: {}"), list(dict.fromkeys(goes)), "ERROR"),
    ):
        if names:
            listed = ", ".join(names[:_NAMES]) + (", ..." if len(names) > _NAMES else "")
            column.label(text=text.format(listed), icon=icon, translate=False)
