"""Choose the selected meshes as source and target."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..comparison import is_copy


class MOBIUS_OT_use_selected(bpy.types.Operator):
    """Make the active mesh the source and the other selected one the target."""

    bl_idname = "mobius.use_selected"
    bl_label = "Use Selected"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two selected meshes, one of them active."""
        chosen = [obj for obj in context.selected_objects if obj.type == "MESH" and not is_copy(obj)]
        if len(chosen) != 2 or context.object not in chosen:
            cls.poll_message_set(rpt_("Select two meshes, the source last: it is the active one"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Choose them."""
        settings, source = context.scene.mobius, context.object
        target = next(obj for obj in context.selected_objects if obj.type == "MESH" and obj != source)
        settings.source, settings.target = source, target
        self.report({"INFO"}, rpt_("From '{}' to '{}'").format(source.name, target.name))
        return {"FINISHED"}
