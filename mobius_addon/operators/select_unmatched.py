"""Select what of the target corresponds to nothing with certainty."""

# no postponed annotations here: Blender reads the properties from them
import bpy
import numpy as np

from ...solver import MeshError
from ...solver.surface.mesh import plural
from .. import stored_alignment, viewport
from ..attributes import mask_weights, unmatched_vertices
from ..mesh_data import Refusal, foreach, read_surface, settle
from ..options import SourceMaskOptions, source_mask
from ..translation import told
from ..usable import why_not_aligned
from .check import select_vertices, tell_unseen


class MOBIUS_OT_select_unmatched(SourceMaskOptions, bpy.types.Operator):
    """Select the vertices of the target that have no certain counterpart on the source, for Edit Mode."""

    bl_idname = "mobius.select_unmatched"
    bl_label = "Select Unmatched"
    bl_options = {"REGISTER", "UNDO"}

    extend: bpy.props.BoolProperty(
        name="Extend", description="Add to what is selected already", default=False, options={"SKIP_SAVE"}
    )
    edit: bpy.props.BoolProperty(
        name="Edit",
        description="Go to Edit Mode where something is selected, and look at it",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that have been aligned."""
        reason = why_not_aligned(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select, and report how much of the target it is."""
        settle(context)
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            surfaces = read_surface(source), read_surface(target)
            found = stored_alignment.load(target, source, surfaces)
            unmatched = unmatched_vertices(found, surfaces[1], mask_weights(source, source_mask(self)))
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        chosen = unmatched
        if self.extend:
            chosen = unmatched | foreach(target.data.vertices, "select", 1, np.bool_)
        hidden = select_vertices(target.data, chosen)
        context.tool_settings.mesh_select_mode = (True, False, False)
        unseen = viewport.edit(context, target) if self.edit and chosen.any() else None
        tell_unseen(self.report, target.name, hidden, unseen)
        number = plural(int(unmatched.sum()), "vertex")
        share = surfaces[1].mesh.vertex_areas[unmatched].sum() / surfaces[1].mesh.area
        verb = "has" if unmatched.sum() == 1 else "have"
        said = f"{number} of '{target.name}' ({share:.1%} of its area) {verb} no certain counterpart"
        self.report({"INFO"}, told(said))
        return {"FINISHED"}
