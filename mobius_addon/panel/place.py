"""Where the panels of the extension are, and what several of them draw."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import stored_alignment
from ..job import Job


class MobiusPanel:
    """Where all panels of the extension are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Möbius"


class MobiusSubPanel(MobiusPanel):
    """A part of the main panel that can be folded."""

    bl_parent_id = "MOBIUS_PT_main"


class AlignedPanel(MobiusSubPanel):
    """A part that is there once the chosen pair has been aligned."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is an alignment."""
        return stored_alignment.pair(context) is not None


class ReportPanel(MobiusPanel):
    """A folded part of the result, about figures of its report."""

    bl_parent_id = "MOBIUS_PT_result"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is a report that says something of this."""
        found = report_of(context)
        return found is not None and cls.has_something(found)

    @classmethod
    def has_something(cls, _found: dict[str, Any]) -> bool:
        """Return whether a report has anything for this part."""
        return True


def report_of(context: bpy.types.Context) -> dict[str, Any] | None:
    """Return the report of the chosen pair's alignment; None if there is none, or none that can be read."""
    pair = stored_alignment.pair(context)
    return stored_alignment.figures(context.scene.mobius.target) if pair is not None else None


def is_current(context: bpy.types.Context) -> bool:
    """Return whether both meshes of the aligned pair are what was aligned."""
    settings = context.scene.mobius
    return stored_alignment.why_stale(settings.target, settings.source) is None


def hand_on(names: Iterable[str], settings: bpy.types.PropertyGroup, operator: bpy.types.OperatorProperties) -> None:
    """Give a button's operator the scene's choices."""
    for name in names:
        setattr(operator, name, getattr(settings, name))


def draw_sentence(layout: bpy.types.UILayout, context: bpy.types.Context, sentence: str, icon: str) -> None:
    """Draw a sentence that may be too long for one row: what is wrong, then what to do about it."""
    for number, text in enumerate(sentence.split(": ", 1)):
        draw_wrapped(layout, context, text, "BLANK1" if number else icon)


def draw_refused(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw why the last work came to nothing, if it was about what is chosen: the status bar says so for seconds."""
    settings, refused = context.scene.mobius, Job.refused
    chosen = settings.target or settings.source  # a target that was deleted is not chosen any more
    if refused is not None and chosen is not None and chosen.session_uid in refused.objects:
        draw_sentence(layout.column(align=True), context, refused.why, "ERROR")


def draw_wrapped(
    layout: bpy.types.UILayout, context: bpy.types.Context, sentence: str, icon: str, *, buttons: int = 0
) -> None:
    """Draw a sentence in as many rows as the region's width needs, where so many icons are buttons beside it."""
    # a letter of Blender's font is 6 pixels wide on average; tabs, margins and the icon take 80, a button 20
    letters = max(16, int((_width(context) - 80 - 20 * buttons) / 6.2))
    for number, row in enumerate(textwrap.wrap(sentence, letters)):
        layout.label(text=row, icon="BLANK1" if number else icon, translate=False)


def beside_or_below(layout: bpy.types.UILayout, context: bpy.types.Context, *labels: str) -> bpy.types.UILayout:
    """Return a row for two buttons with icons or, where their labels would be cut off, a column."""
    # as in `draw_wrapped`: tabs and margins take 60, an icon 20
    letters = int(((_width(context) - 60) / 2 - 20) / 6.2)
    fits = all(len(iface_(label, "Operator")) <= letters for label in labels)
    return layout.row(align=True) if fits else layout.column(align=True)


def _width(context: bpy.types.Context) -> float:
    """Return the region's width in pixels of a scale of 1."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    return (context.region.width if context.region is not None else 300) / scale
