"""Take several objects as one, as a head with its eyes and teeth: a joined copy of them becomes source or target."""

# no postponed annotations here: Blender reads the properties from them
import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..comparison import is_copy
from ..joined import joined_copy
from ..mesh_data import settle
from ..usable import why_not, why_not_object_mode


class MOBIUS_OT_join_copy(bpy.types.Operator):
    """Join a copy of the selected meshes, as of a head with its eyes; they are hidden and stay as they are."""

    bl_idname = "mobius.join_copy"
    bl_label = "Join a Copy"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(
        name="As",
        description="What the joined copy becomes",
        items=(
            ("source", "Source", "It has what is to be carried"),
            ("target", "Target", "It shall get what is carried"),
        ),
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in Object Mode."""
        if reason := why_not_object_mode(context):
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Join it, choose it, and select it alone."""
        settle(context)
        settings = context.scene.mobius
        first = getattr(settings, self.role) or context.object
        others = selected_with(context, self.role)
        if first is None or not others:
            self.report({"ERROR"}, rpt_("Select the meshes that are one thing with the chosen one"))
            return {"CANCELLED"}
        objects = [first, *others]
        for obj in objects:
            if reason := why_not(obj, "mesh", context.scene, writes=False):
                self.report({"ERROR"}, reason)
                return {"CANCELLED"}
        whole = joined_copy(objects, rpt_("{} Joined").format(first.name))
        for obj in objects:
            obj.hide_set(True)
        for obj in context.view_layer.objects:
            obj.select_set(obj == whole)
        context.view_layer.objects.active = whole
        setattr(settings, self.role, whole)
        text = rpt_("'{}' is a joined copy of {} meshes, which are hidden")
        self.report({"INFO"}, text.format(whole.name, len(objects)))
        return {"FINISHED"}


def selected_with(context: bpy.types.Context, role: str) -> list[bpy.types.Object]:
    """Return the selected meshes beside that of a role, by name; none where the other role's is among them."""
    settings = context.scene.mobius
    chosen, other = settings.source, settings.target
    if role == "target":
        chosen, other = other, chosen
    if chosen is None or (other is not None and other.select_get()):
        return []
    meshes = [obj for obj in context.selected_objects if obj.type == "MESH" and not is_copy(obj) and obj != chosen]
    return sorted(meshes, key=lambda obj: obj.name) if chosen.select_get() else []
