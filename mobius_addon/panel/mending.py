"""What mends a mesh itself, offered where its trouble is named."""

from __future__ import annotations

import bpy

from ..operators.mend import MOBIUS_OT_mend, remedy
from ..options import repair
from ..topology_cache import Line, line_of

GENERAL = ("join", "flip")
"""Of these nobody knows whether they help: they are in the menu alone."""


class MOBIUS_MT_mend(bpy.types.Menu):
    """Change the mesh itself, which the computation does not need."""

    bl_label = "Mend Mesh"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what may mend the mesh that the menu was opened for."""
        obj = getattr(context, "mobius_mesh", None)
        if obj is not None:
            for how in line_of(obj, repair(context.scene.mobius)).edits:
                _draw_button(self.layout, obj, how)


def draw_menu(layout: bpy.types.UILayout, obj: bpy.types.Object, line: Line) -> None:
    """Draw the menu's icon, if anything may mend the mesh."""
    if line.edits:
        layout.context_pointer_set("mobius_mesh", obj)
        layout.menu(MOBIUS_MT_mend.__name__, text="", icon="MODIFIER")


def draw_remedies(layout: bpy.types.UILayout, obj: bpy.types.Object, line: Line) -> None:
    """Draw buttons for what is in the way of a mesh that cannot be used."""
    for how in line.edits if line.is_disc is False else ():
        if how not in GENERAL:
            _draw_button(layout, obj, how)


def _draw_button(layout: bpy.types.UILayout, obj: bpy.types.Object, how: str) -> None:
    about = remedy(how)
    button = layout.operator(MOBIUS_OT_mend.bl_idname, text=about.label, icon=about.icon)
    button.object_name, button.how = obj.name, how
