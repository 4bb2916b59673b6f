"""Why a map may be doubtful, with what the panel has against it beside each cause."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ..operators.align import MOBIUS_OT_align
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS
from .place import hand_on

CAUSES = {
    "coarse": n_("Too coarse? Subdivide it"),
    "one way": n_("Only one orientation searched"),
    "steps": n_("Coarse coordinates? Export at the origin"),
    "rough": n_("Noisy? Smooth or remesh it"),
    "slit": n_("Cut open? Merge by Distance"),
    "spike": n_("Spikes? Smooth or delete them"),
    "handle": n_("Handles? Cut and fill them"),
    "narrow": n_("Long and narrow? Cut it"),
    "deep": n_("Too deep? Cut out a piece"),
    "cropped": n_("Little in common? Crop both"),
    "unlike": n_("Two different things?"),
}
"""What is said of each kind of `solver.align.diagnosis.Cause`."""

OPTIONS = {
    "narrow": ("source_cut", "target_cut"),
    "deep": ("source_cut", "target_cut"),
    "cropped": ("source_cut", "target_cut"),
    "unlike": ("landmarks",),
}
"""The options that help, for the next Align."""


def draw_remedies(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, found: dict[str, Any]) -> None:
    """Draw the causes that a report names; results of earlier versions name none."""
    shown: set[str] = set()
    for kind in dict.fromkeys(found.get("causes", ())):
        if kind not in CAUSES:
            continue
        box = layout.box().column(align=True)
        box.label(text=iface_(CAUSES[kind]), icon="QUESTION", translate=False)
        if kind == "one way":
            button = box.operator(MOBIUS_OT_align.bl_idname, text="Search Both Ways", icon="MOD_MIRROR")
            hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
            button.reflect = "auto"
        for name in OPTIONS.get(kind, ()):
            if name not in shown:
                box.prop(settings, name)
            shown.add(name)
