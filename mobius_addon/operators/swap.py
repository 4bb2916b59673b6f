"""Exchange source and target."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_


class MOBIUS_OT_swap(bpy.types.Operator):
    """Make the source the target and the target the source."""

    bl_idname = "mobius.swap"
    bl_label = "Swap Source and Target"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow where something is chosen."""
        settings = context.scene.mobius
        if settings.source is None and settings.target is None:
            cls.poll_message_set(rpt_("Choose a source or target mesh first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Exchange them."""
        settings = context.scene.mobius
        settings.source, settings.target = settings.target, settings.source
        return {"FINISHED"}
