"""Find the certified correspondence between two meshes and show it on both."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy
import numpy as np
from scipy.spatial import KDTree

from ... import solver
from ...solver.mesh import Floats
from .. import results, stored_alignment
from ..attributes import MATCHED_GROUP, SHARED_COLOR, SHARED_LAYOUT
from ..computation import aligned
from ..jobs import JobOperator, Report, Work
from ..mesh_data import Refusal, read_surface, scale_warning
from ..options import AlignOptions, ScanOptions, align_settings, outer_vertex
from ..preferences import preferences
from ..usable import why_not_pair


class MOBIUS_OT_align(JobOperator, AlignOptions, ScanOptions, bpy.types.Operator):
    """Match source and target: both get a shared UV map, corresponding colors and a group of matched points."""

    bl_idname = "mobius.align"
    bl_label = "Align"
    bl_options = {"REGISTER", "UNDO"}
    job_title = "Align"

    time_limit: bpy.props.FloatProperty(
        name="Time Limit",
        description="Seconds after which a search stops and reports its gap; 0: none. By default the add-on's",
        default=solver.AlignSettings().time_limit or 0.0,
        min=0.0,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that can be written."""
        reason = why_not_pair(context.scene.mobius, context.scene, writes_source=True)
        if context.window_manager.mobius_job.running:
            reason = "An alignment is running: press ESC to stop it"
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read both meshes."""
        settings = context.scene.mobius
        self._names = settings.source.name, settings.target.name
        self._surfaces = read_surface(settings.source), read_surface(settings.target)
        for obj in (settings.source, settings.target):
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        limit = self.time_limit
        if not self.properties.is_property_set("time_limit") and (kept := preferences(context)):
            limit = kept.time_limit
        source, target = (surface.mesh for surface in self._surfaces)
        outer = outer_vertex(settings.source, source, self), outer_vertex(settings.target, target, self)
        options, largest_part = align_settings(self, limit, outer), self.largest_part

        def work(report: Report) -> tuple[solver.Alignment, solver.Correspondence]:
            return aligned(source, target, options, largest_part=largest_part, progress=report)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> None:
        """Write on both meshes, if they are still what was read."""
        alignment, correspondence = result
        objects = [bpy.data.objects.get(name) for name in self._names]
        for obj, name, surface in zip(objects, self._names, self._surfaces, strict=True):
            if obj is None or obj.type != "MESH" or obj.mode != "OBJECT":
                raise Refusal(f"'{name}' was removed or is being edited since the alignment began: align again")
            if read_surface(obj).fingerprint() != surface.fingerprint():
                raise Refusal(f"'{name}' was edited during the alignment: align again")
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        source, target = objects
        write_alignment(source, target, alignment, correspondence, self._surfaces)
        stored_alignment.store(target, source, alignment, correspondence, self._surfaces)
        for warning in [scale_warning(source), scale_warning(target), *alignment.warnings]:
            if warning:
                self.report({"WARNING"}, warning)
        self.report({"INFO"}, summary(source.name, target.name, alignment, correspondence))


def write_alignment(
    source: bpy.types.Object,
    target: bpy.types.Object,
    alignment: solver.Alignment,
    correspondence: solver.Correspondence,
    surfaces: Any,
) -> None:
    """Write the shared UV layout, the colors and the groups of matched points on both meshes."""
    carried = alignment.mobius(alignment.source.disc)
    results.write_layout(source, SHARED_LAYOUT, carried, surfaces[0])
    results.write_layout(target, SHARED_LAYOUT, alignment.mobius(alignment.carried), surfaces[1])
    used = np.isfinite(carried)
    color = results.disc_color(np.where(used, carried, 0))
    results.write_color(source, SHARED_COLOR, color, used)
    results.write_color(target, SHARED_COLOR, solver.interpolate(correspondence, color), correspondence.face >= 0)
    matched = np.where(correspondence.matched, correspondence.confidence, 0.0)
    results.write_group(target, MATCHED_GROUP, matched)
    results.write_group(source, MATCHED_GROUP, on_source(alignment, correspondence, matched))


def on_source(alignment: solver.Alignment, correspondence: solver.Correspondence, values: Floats) -> Floats:
    """Return values per target vertex, (n_target,), carried to source vertices: each takes the nearest that arrives."""
    mesh = alignment.source.mesh
    found = np.flatnonzero(correspondence.face >= 0)
    places = (correspondence.matrix() @ mesh.vertices)[found]
    on_vertices = np.zeros(len(mesh.vertices))
    used = np.unique(mesh.faces)
    on_vertices[used] = values[found[KDTree(places).query(mesh.vertices[used])[1]]]
    return on_vertices


def summary(source: str, target: str, alignment: solver.Alignment, correspondence: solver.Correspondence) -> str:
    """Return one sentence about an alignment: what matched, and what is proved about it."""
    search = alignment.search
    proof = (
        f"certified: no Möbius map with |z| <= {alignment.settings.z_max:.2f} matches more"
        if search.certified
        else f"not certified: the proven bound is {search.upper_bound:.2f}, a gap of {search.gap:.2f}"
    )
    mirrored = ", mirrored" if alignment.mobius.reflected else ""
    return (
        f"'{source}' on '{target}'{mirrored}: matched value {search.value:.2f} of at most "
        f"{len(alignment.source_samples)}, {proof}; {correspondence.matched.mean():.0%} of the vertices matched"
    )
