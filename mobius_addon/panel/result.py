"""What the last alignment of the chosen pair found and proved."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import stored_alignment
from ..operators.align import MOBIUS_OT_align
from ..options import ALIGN_OPTIONS, SCAN_OPTIONS
from .place import MobiusSubPanel, hand_on
from .remedies import draw_remedies


class MOBIUS_PT_result(MobiusSubPanel, bpy.types.Panel):
    """What the last alignment of the chosen pair found and proved."""

    bl_label = "Result"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is one."""
        return stored_alignment.pair(context) is not None

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
            said = iface_("No rotation matches more, no map with {} over {:.1f} % more")
            column.label(text=said.format(found["certified_for"], share), icon="CHECKMARK", translate=False)
        elif found["rival_taken"]:
            column.label(text=iface_("Not the best match: gap {:.2f}").format(found["gap"]), icon="INFO")
        else:
            column.label(text=iface_("Not certified: gap {:.2f}").format(found["gap"]), icon="ERROR")
        for name, value in _rows(found):
            row = column.split(factor=0.5)
            row.label(text=name)
            row.label(text=value, translate=False)
        _draw_doubts(layout, settings, found)
        draw_remedies(layout, settings, found)


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
    if several := found.get("parts"):
        paired = sum(bool(pair["source"] and pair["target"]) for pair in several)
        rows.append((iface_("Parts"), iface_("{:,} of {:,}").format(paired, sum(bool(x["target"]) for x in several))))
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
        hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        button.reflect = "never" if reflected else "always"
    if rival is not None and rival <= near:
        box = layout.box().column(align=True)
        box.label(text="Ambiguous: is it symmetric?", icon="QUESTION")
        taken = found["settings"]["take_rival"]
        text = iface_("Take the Best Again") if taken else iface_("Take the Rival")
        button = box.operator(MOBIUS_OT_align.bl_idname, text=text, icon="FILE_REFRESH")
        hand_on((*ALIGN_OPTIONS, *SCAN_OPTIONS), settings, button)
        button.take_rival = not taken
