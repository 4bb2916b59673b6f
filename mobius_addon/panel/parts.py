"""Which part of the target is which of the source."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .place import ReportPanel, report_of

MOST_ROWS = 60
"""Parts that the panel lists: a head has up to 56, hair has hundreds of cards."""


class MOBIUS_PT_parts(ReportPanel, bpy.types.Panel):
    """Which part of the target is which of the source."""

    bl_label = "Parts"

    @classmethod
    def has_something(cls, found: dict[str, Any]) -> bool:
        """Return whether the meshes have several parts."""
        return bool(found.get("parts"))

    def draw(self, context: bpy.types.Context) -> None:
        """Draw a row for each part."""
        column = self.layout.column(align=True)
        row = column.split(factor=0.5)
        row.label(text="Source")
        row.label(text="Target")
        found = (report_of(context) or {}).get("parts") or []
        for pair in found[:MOST_ROWS]:
            row = column.split(factor=0.5)
            for role in ("source", "target"):
                own, icon = pair[role], "LINKED" if pair["source"] and pair["target"] else "UNLINKED"
                text = "–" if own is None else iface_("{}: {:,} vertices").format(own["part"] + 1, own["vertices"])
                row.label(text=text, icon=icon if role == "source" else "NONE", translate=False)
        if len(found) > MOST_ROWS:
            column.label(text=iface_("and {} more, see the report").format(len(found) - MOST_ROWS), translate=False)
