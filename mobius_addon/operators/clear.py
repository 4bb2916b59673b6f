"""Take away what the extension has left on meshes and in the scene, but for what was transferred."""

# no postponed annotations here: Blender reads the properties from them
import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .. import comparison, viewport
from ..jobs import why_busy
from ..results import clear_results
from ..usable import why_not_mode, why_not_written


class MOBIUS_OT_clear(bpy.types.Operator):
    """Remove what Align, Flatten and Show have left on meshes; what was active before is so again."""

    bl_idname = "mobius.clear"
    bl_label = "Clear Möbius Data"
    bl_options = {"REGISTER", "UNDO"}

    clear_from: bpy.props.EnumProperty(
        name="From",
        description="Which meshes are cleared; what was transferred to them stays",
        items=(
            ("pair", "Source and Target", "The chosen source and target"),
            ("selected", "Selected", "All selected meshes"),
            ("all", "All", "All meshes of the file"),
        ),
        default="pair",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in Object Mode, while nothing is being computed."""
        reason = why_not_mode(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove everything, and report what it was."""
        cleared, removed, ended = 0, 0, False
        for obj in self._objects(context):
            if reason := why_not_written(obj):
                self.report({"WARNING"}, reason)
                continue
            ended |= comparison.end_for(obj.data)
            count = clear_results(obj)
            cleared, removed = cleared + bool(count), removed + count
        if not (removed or ended):
            self.report({"INFO"}, rpt_("There is no Möbius data on these meshes"))
            return {"CANCELLED"}
        if ended:
            viewport.look_at_all_again(context)
        viewport.show_as_before(context)
        self.report({"INFO"}, rpt_("Meshes cleared: {}, layers and alignments removed: {}").format(cleared, removed))
        return {"FINISHED"}

    def _objects(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        """Return one mesh object for each of the meshes."""
        chosen = {
            "pair": lambda: (context.scene.mobius.source, context.scene.mobius.target),
            "selected": lambda: context.selected_objects,
            "all": lambda: bpy.data.objects,
        }[self.clear_from]()
        meshes = {obj.data: obj for obj in chosen if obj is not None and obj.type == "MESH"}
        return list(meshes.values())
