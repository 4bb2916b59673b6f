"""Flatten a mesh to the unit disc, as a UV map."""

import bpy

from ... import solver
from ..attributes import DISC_LAYOUT
from ..mesh_data import Refusal, read_surface
from ..results import write_layout
from ..usable import why_not


class MOBIUS_OT_flatten(bpy.types.Operator):
    """Flatten the active mesh conformally to a disc, as the UV map Mobius Disc."""

    bl_idname = "mobius.flatten"
    bl_label = "Flatten to Disc"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for a mesh in Object Mode that can be written."""
        if reason := why_not(context.object, "mesh", context.scene):
            cls.poll_message_set(reason)
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the UV map."""
        obj = context.object
        try:
            surface = read_surface(obj)
            flattening = solver.flatten(surface.mesh)
            write_layout(obj, DISC_LAYOUT, flattening.disc, surface)
        except (Refusal, solver.MeshError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        found = flattening.distortion
        flips = f", {found.flips} triangles turned over" if found.flips else ""
        self.report(
            {"INFO"},
            f"'{obj.name}' is flat in the UV map '{DISC_LAYOUT}': "
            f"angles are off by {found.mean_angle_error:.1f}° on average{flips}",
        )
        return {"FINISHED"}
