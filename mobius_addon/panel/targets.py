"""All meshes that the source was aligned with, each with its verdict: what *Align Selected* has left."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import stored_alignment
from ..comparison import is_copy
from ..operators.choose_target import MOBIUS_OT_choose_target
from ..verdict import LEVELS, judgement_of
from .place import MobiusSubPanel

MOST_ROWS = 40
"""Targets that are listed, the doubtful ones first: a panel longer than this is not read."""

ORDER = ("damaged", "edited", "doubtful", "check", "good")


@dataclass(frozen=True)
class Row:
    """A target as it is listed.

    Attributes
    ----------
    obj : bpy.types.Object
    level : str
        One of `ORDER`.
    coverage : float
        Share that is matched.
    warnings : int
    """

    obj: bpy.types.Object
    level: str
    coverage: float = 0.0
    warnings: int = 0


def rows(context: bpy.types.Context) -> list[Row]:
    """Return the targets of the chosen source, those first that are to be looked at."""
    source = context.scene.mobius.source
    if source is None or source.type != "MESH":
        return []
    found = []
    for obj in context.scene.objects:
        if obj.type != "MESH" or obj == source or is_copy(obj) or not stored_alignment.exists(obj, source):
            continue
        figures = stored_alignment.figures(obj)
        if figures is None:
            found.append(Row(obj, "damaged"))
            continue
        level = "edited" if stored_alignment.why_stale(obj, source) else judgement_of(figures).level
        found.append(Row(obj, level, figures["coverage"], len(figures.get("warnings", ()))))
    return sorted(found, key=lambda row: (ORDER.index(row.level), row.obj.name))


class MOBIUS_PT_targets(MobiusSubPanel, bpy.types.Panel):
    """All meshes that the source was aligned with."""

    bl_label = "Aligned Targets"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there are several."""
        return len(rows(context)) > 1

    def draw(self, context: bpy.types.Context) -> None:
        """Draw a row for each target: a click makes it the one that the rest of the panel is about."""
        listed, chosen = rows(context), context.scene.mobius.target
        column = self.layout.column(align=True)
        for row in listed[:MOST_ROWS]:
            if row.level in LEVELS:
                text, icon = f"{row.obj.name}   {row.coverage:.0%}", LEVELS[row.level][1]
            else:
                said = iface_("edited since") if row.level == "edited" else iface_("damaged")
                text, icon = f"{row.obj.name}   {said}", "FILE_REFRESH"
            if row.warnings:
                text += "   " + iface_("Warnings: {:,}").format(row.warnings)
            button = column.operator(
                MOBIUS_OT_choose_target.bl_idname, text=text, icon=icon, translate=False, depress=row.obj == chosen
            )
            button.object_name = row.obj.name
        if len(listed) > MOST_ROWS:
            column.label(text=iface_("and {:,} more").format(len(listed) - MOST_ROWS), icon="BLANK1", translate=False)
