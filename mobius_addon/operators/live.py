"""Have the target follow an attribute of the source, without writing it."""

# no postponed annotations here: Blender reads the properties from them
import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import MeshError
from .. import live, stored_alignment
from ..attributes import restored_on_failure
from ..jobs import why_busy
from ..mesh_data import Refusal, read_surface, settle
from ..translation import told
from ..usable import why_not_aligned


class MOBIUS_OT_live(bpy.types.Operator):
    """Have the target follow an attribute of the source by a modifier: what is changed on the source later changes
    here too."""  # noqa: D205, D209  (the tooltip)

    bl_idname = "mobius.live"
    bl_label = "Follow Live"
    bl_options = {"REGISTER", "UNDO"}

    attribute: bpy.props.StringProperty(
        name="Attribute", description="Vertex group or attribute of the source that the target follows"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes that have been aligned, of which the target can be written."""
        reason = why_not_aligned(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the correspondence on the target and add the modifier."""
        settle(context)
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            if not self.attribute:
                raise Refusal(rpt_("Choose an attribute of the source first"))
            live.type_on(source, self.attribute)
            surfaces = read_surface(source), read_surface(target)
            found = stored_alignment.load(target, source, surfaces)
            with restored_on_failure(target):
                live.write_map(target, surfaces[0], found)
                live.add_modifier(target, source, self.attribute)
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        self.report({"INFO"}, rpt_("'{}' follows '{}' of '{}'").format(target.name, self.attribute, source.name))
        return {"FINISHED"}
