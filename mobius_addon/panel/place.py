"""Where the panels of the extension are, and what several of them draw."""

from __future__ import annotations

from collections.abc import Iterable

import bpy


class MobiusPanel:
    """Where all panels of the extension are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Möbius"


class MobiusSubPanel(MobiusPanel):
    """A part of the main panel that can be folded."""

    bl_parent_id = "MOBIUS_PT_main"


def hand_on(names: Iterable[str], settings: bpy.types.PropertyGroup, operator: bpy.types.OperatorProperties) -> None:
    """Give a button's operator the scene's choices."""
    for name in names:
        setattr(operator, name, getattr(settings, name))


def draw_sentence(layout: bpy.types.UILayout, sentence: str, icon: str) -> None:
    """Draw a sentence that may be too long for one row: what is wrong, then what to do about it."""
    for number, text in enumerate(sentence.split(": ", 1)):
        layout.label(text=text, icon="BLANK1" if number else icon, translate=False)
