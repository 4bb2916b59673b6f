"""Make one of several meshes that the source was aligned with the target."""

# no postponed annotations here: Blender reads the properties from them
import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .. import stored_alignment
from ..translation import told
from ..usable import why_not_mode


class MOBIUS_OT_choose_target(bpy.types.Operator):
    """Make this mesh the target, and select it: the result below is then about it."""

    bl_idname = "mobius.choose_target"
    bl_label = "Choose Target"
    bl_options = {"UNDO", "INTERNAL"}  # which F3, that knows no name to give it, leaves out

    object_name: bpy.props.StringProperty(name="Object", description="Its name", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for Object Mode."""
        if reason := why_not_mode(context):
            cls.poll_message_set(reason)
        return not reason

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        """Return what is to be said of the alignment, for the tooltip."""
        obj = context.scene.objects.get(properties.object_name)
        found = stored_alignment.figures(obj) if obj is not None and obj.type == "MESH" else None
        said = found.get("warnings", ()) if found else ()
        return "\n".join([rpt_(cls.__doc__ or "").rstrip("."), *map(told, said)])

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Choose and select it alone."""
        chosen = context.scene.objects.get(self.object_name)
        if chosen is None or chosen.type != "MESH":
            self.report({"ERROR"}, rpt_("There is no mesh '{}' in this scene").format(self.object_name))
            return {"CANCELLED"}
        context.scene.mobius.target = chosen
        shown = context.view_layer.objects
        if chosen.name in shown:
            for obj in shown:
                obj.select_set(obj == chosen)
            shown.active = chosen
        return {"FINISHED"}
