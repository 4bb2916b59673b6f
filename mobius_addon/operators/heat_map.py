"""Color the target by what the alignment is worth at each point."""

# no postponed annotations here: Blender reads the properties from them
import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import MeshError
from .. import stored_alignment
from ..heat_maps import MAP_MEASURES, measure
from ..mesh_data import Refusal, read_surface, settle
from ..results import require_room, write_color
from ..translation import told
from ..usable import why_not_aligned
from ..viewport import show_colors


class MOBIUS_OT_heat_map(bpy.types.Operator):
    """Color the target by the confidence or the distortion of its map to the source, as a color attribute."""

    bl_idname = "mobius.heat_map"
    bl_label = "Heat Map"
    bl_options = {"REGISTER", "UNDO"}

    measure: bpy.props.EnumProperty(
        name="Show",
        description="What the colors mean",
        items=tuple((x.identifier, x.label, x.description) for x in MAP_MEASURES),
        default=MAP_MEASURES[0].identifier,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that have been aligned."""
        reason = why_not_aligned(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the colors, and show them where Blender has a window."""
        settle(context)
        source, target = context.scene.mobius.source, context.scene.mobius.target
        shown = measure(self.measure, MAP_MEASURES)
        try:
            surfaces = read_surface(source), read_surface(target)
            found = stored_alignment.load(target, source, surfaces)
            require_room(target, [], [shown.attribute])
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        write_color(target, shown.attribute, *shown.color(found, *(surface.mesh for surface in surfaces)))
        show_colors(context)
        self.report({"INFO"}, rpt_("'{}' shows its colors in '{}'").format(target.name, shown.attribute))
        return {"FINISHED"}
