"""Choose the selected meshes as source and target."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..comparison import is_copy
from ..usable import instance


class MOBIUS_OT_use_selected(bpy.types.Operator):
    """Make the active mesh the source and the other selected one the target; of several the first by name."""

    bl_idname = "mobius.use_selected"
    bl_label = "Use Selected"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for selected meshes, one of them active."""
        chosen = _chosen(context)
        if len(chosen) < 2 or context.object not in chosen:
            shown = next((obj for obj in context.selected_objects if obj.instance_type == "COLLECTION"), None)
            text = rpt_("Select the target, or several, and the source last: it is the active one")
            cls.poll_message_set(text if shown is None else instance(shown))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Choose them."""
        settings, source = context.scene.mobius, context.object
        targets = [obj for obj in _chosen(context) if obj != source]
        settings.source, settings.target = source, targets[0]
        if len(targets) > 1:
            text = rpt_("From '{}' to {} meshes: press Align Selected")
            self.report({"INFO"}, text.format(source.name, len(targets)))
        else:
            self.report({"INFO"}, rpt_("From '{}' to '{}'").format(source.name, targets[0].name))
        return {"FINISHED"}


def _chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected meshes by name."""
    chosen = [obj for obj in context.selected_objects if obj.type == "MESH" and not is_copy(obj)]
    return sorted(chosen, key=lambda obj: obj.name)
