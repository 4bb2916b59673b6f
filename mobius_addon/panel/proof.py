"""What is proved about the result, folded away: who wants to know why it can be believed looks here."""

from __future__ import annotations

import bpy

from .. import stored_alignment
from ..proof import TERMS, shown
from .place import MobiusPanel, draw_wrapped
from .result import MOBIUS_PT_result
from .verdict import judgement_of


class MOBIUS_PT_proof(MobiusPanel, bpy.types.Panel):
    """What is proved about the result."""

    bl_label = "Proof"
    bl_parent_id = "MOBIUS_PT_result"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where there is a result that can be read."""
        return MOBIUS_PT_result.poll(context) and stored_alignment.figures(context.scene.mobius.target) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw each term; the tooltips say what they mean."""
        layout, settings = self.layout, context.scene.mobius
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(align=True)
        for term in TERMS:
            if shown(settings.target, term):
                column.prop(settings.proof, term)


class MOBIUS_PT_notes(MobiusPanel, bpy.types.Panel):
    """What was done to the meshes for the computation, which changed nothing of them."""

    bl_label = "Done for the Computation"
    bl_parent_id = "MOBIUS_PT_result"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show where anything was done."""
        found = stored_alignment.figures(context.scene.mobius.target) if MOBIUS_PT_result.poll(context) else None
        return found is not None and bool(judgement_of(found).notes)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sentences."""
        for sentence in judgement_of(stored_alignment.figures(context.scene.mobius.target) or {}).notes:
            draw_wrapped(self.layout.column(align=True), context, sentence, "DOT")
