"""Flatten a mesh to the unit disc, as a UV map."""

# no postponed annotations here: Blender reads the properties from them
import bpy
import numpy as np

from ...solver import MeshError
from ..attributes import DISC_LAYOUT
from ..computation import flattened
from ..heat_maps import DISC_MEASURES, measure
from ..mesh_data import Refusal, read_surface, settle
from ..options import ScanOptions, outer_vertex, repair
from ..results import require_room, write_color, write_layout
from ..translation import told
from ..usable import why_not, why_not_mode


class MOBIUS_OT_flatten(ScanOptions, bpy.types.Operator):
    """Flatten the active mesh conformally to a disc, as the UV map Mobius Disc."""

    bl_idname = "mobius.flatten"
    bl_label = "Flatten to Disc"
    bl_options = {"REGISTER", "UNDO"}

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the conformal map is computed",
        items=(
            ("harmonic", "Harmonic", "Harmonic measure and extension: the most accurate, on every mesh"),
            ("mid-edge", "Mid-edge", "Conjugate harmonic functions at the edges' midpoints, as in the literature"),
        ),
        default="harmonic",
    )
    distortion: bpy.props.EnumProperty(
        name="Distortion",
        description="Write how far the map is from an isometry as a color attribute",
        items=(
            ("none", "None", "Write no colors"),
            *((x.identifier, x.label, x.description) for x in DISC_MEASURES),
        ),
        default="none",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for a mesh in Object Mode that can be written."""
        if reason := why_not(context.object, "mesh", context.scene) or why_not_mode(context):
            cls.poll_message_set(reason)
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the UV map and the colors."""
        settle(context)
        obj = context.object
        shown = None if self.distortion == "none" else measure(self.distortion, DISC_MEASURES)
        try:
            require_room(obj, [DISC_LAYOUT], [shown.attribute] if shown else [])
            surface = read_surface(obj)
            outer = outer_vertex(obj, surface, self)
            flat = flattened(surface.mesh, self.method, repair(self), outer=outer, keys=surface.keys)
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        flattening = flat.flattening
        write_layout(obj, DISC_LAYOUT, flat.tidy.at_corners(flattening.disc, np.nan), surface)
        if shown:
            color, known = shown.color(flattening)
            write_color(obj, shown.attribute, flat.tidy.at_vertices(color, 0), flat.tidy.at_vertices(known, False))
        for note in flat.notes:
            self.report({"WARNING"}, told(note))
        found = flattening.distortion
        flips = f", {found.flips} triangles turned over" if found.flips else ""
        colors = f"; its colors are in '{shown.attribute}'" if shown else ""
        said = (
            f"'{obj.name}' is flat in the UV map '{DISC_LAYOUT}': "
            f"angles are off by {found.mean_angle_error:.1f}° on average (at most {found.max_angle_error:.0f}°), "
            f"dilatation {found.mean_dilatation:.2f} (at most {found.max_dilatation:.1f}), "
            f"lengths times {np.exp(found.min_log_factor):.2g} to {np.exp(found.max_log_factor):.2g}{flips}{colors}"
        )
        self.report({"INFO"}, told(said))
        return {"FINISHED"}
