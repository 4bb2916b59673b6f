"""Which part of the target is which of the source."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import stored_alignment
from .place import MobiusPanel
from .result import MOBIUS_PT_result

MOST_ROWS = 60
"""Parts that the panel lists: a head has up to 56, hair has hundreds of cards."""


class MOBIUS_PT_parts(MobiusPanel, bpy.types.Panel):
    """Which part of the target is which of the source."""

    bl_label = "Parts"
    bl_parent_id = "MOBIUS_PT_result"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where an alignment is of meshes with several parts."""
        return MOBIUS_PT_result.poll(context) and bool(_parts_of(context))

    def draw(self, context: bpy.types.Context) -> None:
        """Draw a row for each part."""
        column = self.layout.column(align=True)
        row = column.split(factor=0.5)
        row.label(text="Source")
        row.label(text="Target")
        found = _parts_of(context)
        for pair in found[:MOST_ROWS]:
            row = column.split(factor=0.5)
            for role in ("source", "target"):
                own, icon = pair[role], "LINKED" if pair["source"] and pair["target"] else "UNLINKED"
                text = "–" if own is None else iface_("{}: {:,} vertices").format(own["part"] + 1, own["vertices"])
                row.label(text=text, icon=icon if role == "source" else "NONE", translate=False)
        if len(found) > MOST_ROWS:
            column.label(text=iface_("and {} more, see the report").format(len(found) - MOST_ROWS), translate=False)


def _parts_of(context: bpy.types.Context) -> list[dict[str, Any]]:
    """Return the rows of the report about parts."""
    found = stored_alignment.figures(context.scene.mobius.target)
    return (found or {}).get("parts") or []
