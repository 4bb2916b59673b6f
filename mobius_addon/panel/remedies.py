"""What speaks against a result, each with what can be done about it as a button or a choice beside it."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ...solver.align.judgement import ENOUGH, Judgement
from ..operators.align import MOBIUS_OT_align
from ..operators.heat_map import MOBIUS_OT_heat_map
from ..operators.select_unmatched import MOBIUS_OT_select_unmatched
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS, SOURCE_MASK_OPTIONS
from ..translation import told
from .place import draw_wrapped, hand_on

OPTIONS = {
    "narrow": ("source_cut", "target_cut"),
    "deep": ("source_cut", "target_cut"),
    "cropped": ("source_cut", "target_cut"),
    "unlike": ("landmarks",),
    "unsure": ("landmarks",),
    "doubtful": ("landmarks",),
}
"""The options that help against each kind of concern, for the next Align."""

BUTTONS = {
    "one way": (n_("Search Both Ways"), "MOD_MIRROR"),
    "unproved": (n_("Search Without Time Limit"), "TIME"),
}
"""The label and icon of the button that aligns again otherwise, for kinds where it is always the same one."""


def draw_concerns(
    layout: bpy.types.UILayout, context: bpy.types.Context, found: dict[str, Any], judgement: Judgement
) -> None:
    """Draw every concern of a verdict, with its remedy."""
    settings, drawn = context.scene.mobius, set()
    if found["coverage"] < ENOUGH:
        box = layout.box().column(align=True)
        text = iface_("{:.0%} of the target has no sure counterpart").format(1 - found["coverage"])
        draw_wrapped(box, context, text, "QUESTION")
        button = box.operator(MOBIUS_OT_select_unmatched.bl_idname, icon="RESTRICT_SELECT_OFF")
        hand_on(SOURCE_MASK_OPTIONS, settings, button)
        button.edit = True
    elif judgement.level != "good" and not judgement.concerns:
        box = layout.box().column(align=True)
        box.label(text="Not sure everywhere", icon="QUESTION")
        box.operator(MOBIUS_OT_heat_map.bl_idname, text="See Where", icon="COLOR").measure = "confidence"
    for concern in judgement.concerns:
        box = layout.box().column(align=True)
        draw_wrapped(box, context, told(concern.text), "QUESTION")
        _draw_button(box, settings, found, concern.kind)
        names = [name for name in OPTIONS.get(concern.kind, ()) if name not in drawn]
        for name in names:
            row = box.split(factor=0.5, align=True)
            row.label(text=settings.bl_rna.properties[name].name)
            row.prop(settings, name, text="")
        drawn |= set(names)


def _draw_button(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, found: dict[str, Any], kind: str
) -> None:
    """Draw the button that aligns again with the other choice, if there is one for this kind of concern."""
    reflected, taken = found["mobius"]["reflected"], found["settings"]["take_rival"]
    if kind == "orientation":
        text, icon = iface_("Take Not Mirrored") if reflected else iface_("Take Mirrored"), "MOD_MIRROR"
    elif kind == "rival":
        text, icon = iface_("Take the Best Again") if taken else iface_("Take the Rival"), "FILE_REFRESH"
    elif kind in BUTTONS:
        text, icon = iface_(BUTTONS[kind][0]), BUTTONS[kind][1]
    else:
        return
    button = layout.operator(MOBIUS_OT_align.bl_idname, text=text, icon=icon, translate=False)
    hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
    if kind == "orientation":
        button.reflect = "never" if reflected else "always"
    elif kind == "rival":
        button.take_rival = not taken
    elif kind == "one way":
        button.reflect = "auto"
    else:
        button.time_limit = 0.0
