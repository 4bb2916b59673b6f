"""What is proved about the result, folded away: who wants to know why it can be believed looks here."""

from __future__ import annotations

from typing import Any

import bpy

from ..proof import TERMS, shown
from ..translation import told
from ..verdict import judgement_of
from .place import ReportPanel, draw_wrapped, report_of


class MOBIUS_PT_proof(ReportPanel, bpy.types.Panel):
    """What is proved about the result."""

    bl_label = "Proof"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw each term; the tooltips say what they mean."""
        layout, settings = self.layout, context.scene.mobius
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(align=True)
        for term in TERMS:
            if shown(settings.target, term):
                column.prop(settings.proof, term)


class MOBIUS_PT_notes(ReportPanel, bpy.types.Panel):
    """What was done to the meshes for the computation, which changed nothing of them."""

    bl_label = "Done for the Computation"

    @classmethod
    def has_something(cls, found: dict[str, Any]) -> bool:
        """Return whether anything was done."""
        return bool(judgement_of(found).notes)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sentences."""
        for sentence in judgement_of(report_of(context) or {}).notes:
            draw_wrapped(self.layout.column(align=True), context, told(sentence), "DOT")
