"""Say what a mesh is, and select what keeps it from being a disc."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...solver import MeshError, Topology, TriangleMesh, topology, verdict
from ...solver.align.cut.held import held
from ...solver.surface.mesh import Booleans
from .. import topology_cache, viewport
from ..mesh_data import foreach, read_surface, settle
from ..options import repair
from ..translation import told
from ..usable import why_not, why_not_object_mode


class MOBIUS_OT_check(bpy.types.Operator):
    """Say whether a mesh is a disc (one piece, one boundary), and select what is in the way."""

    bl_idname = "mobius.check"
    bl_label = "Check Mesh"
    bl_options = {"REGISTER", "UNDO"}

    object_name: bpy.props.StringProperty(
        name="Object", description="Mesh object to check; the active object if empty", options={"SKIP_SAVE"}
    )
    select: bpy.props.BoolProperty(
        name="Select Trouble", description="Select the vertices that are in the way, for Edit Mode", default=True
    )
    edit: bpy.props.BoolProperty(
        name="Edit",
        description="Go to Edit Mode where something is selected, and look at it",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow wherever objects can be looked at."""
        if reason := why_not_object_mode(context):
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Report one sentence."""
        settle(context)
        obj: Any = bpy.data.objects.get(self.object_name) if self.object_name else context.object
        if self.object_name and obj is None:
            self.report({"ERROR"}, told(f"there is no object '{self.object_name}'"))
            return {"CANCELLED"}
        if reason := why_not(obj, "mesh", context.scene, writes=False):
            self.report({"ERROR"}, reason)
            return {"CANCELLED"}
        try:
            surface = read_surface(obj)
        except MeshError as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        mesh, asked = surface.mesh, repair(context.scene.mobius)
        topology_cache.store(obj, surface, asked)
        found = topology(mesh)
        try:
            whole = verdict(mesh, largest_part=asked.largest_part, fill_holes=asked.fill_holes, keys=surface.keys)
        except MeshError as error:
            line = told(str(error))
        else:
            line = f"'{obj.name}': {told(whole.describe())}"
            try:
                badly = held(whole.tidy, fill_holes=asked.fill_holes)
                said = iface_(topology_cache.HELD[badly.kind]) if badly else ""
            except MeshError as error:
                said = told(str(error))
            line = f"{line}; {said}" if said else line
            if not whole.repairs:
                self.report({"WARNING" if said else "INFO"}, line)
                return {"FINISHED"}
        trouble = troubled_vertices(mesh, found)
        if self.select and trouble.any() and obj.data.is_editable:
            hidden = select_vertices(obj.data, trouble)
            context.tool_settings.mesh_select_mode = (True, False, False)
            unseen = viewport.edit(context, obj) if self.edit else None
            found_there = rpt_("{} ({:,} vertices are selected: see them in Edit Mode)")
            line = found_there.format(line, int(trouble.sum()) - hidden)
            tell_unseen(self.report, obj.name, hidden, unseen)
        self.report({"WARNING"}, line)
        return {"FINISHED"}


def troubled_vertices(mesh: TriangleMesh, found: Topology) -> Booleans:
    """Return which vertices, (n,), are part of what keeps the mesh from being a disc.

    Of several parts or boundary loops the largest is taken as the one to keep.
    """
    trouble = np.zeros(len(mesh.vertices), bool)
    trouble[mesh.faces[found.degenerate_faces]] = True
    trouble[mesh.faces[found.duplicate_faces]] = True
    for indices in (found.non_manifold_edges, found.inconsistent_edges, found.non_manifold_vertices):
        trouble[indices] = True
    if found.parts > 1:
        trouble |= outside_largest_part(mesh)
    elif not trouble.any():
        for loop in found.boundary_loops[1:]:
            trouble[loop] = True
    return trouble


def outside_largest_part(mesh: TriangleMesh) -> Booleans:
    """Return which vertices, (n,), are in a face but not in the connected part of most vertices."""
    n = len(mesh.vertices)
    i, j = mesh.edges.T
    label = connected_components(coo_array((np.ones(len(i), np.int8), (i, j)), shape=(n, n)), directed=False)[1]
    used = np.zeros(n, bool)
    used[mesh.faces] = True
    return used & (label != np.argmax(np.bincount(label[used])))


def select_vertices(mesh: bpy.types.Mesh, chosen: Booleans) -> int:
    """Select exactly these vertices, (n,), and the edges and polygons that lie among them.

    Returns
    -------
    int
        How many of them are hidden in Edit Mode and are left out, as Blender's own tools do.
    """
    hidden = chosen & foreach(mesh.vertices, "hide", 1, np.bool_)
    chosen = chosen & ~hidden
    mesh.vertices.foreach_set("select", chosen)
    edges = foreach(mesh.edges, "vertices", 2, np.int32)
    mesh.edges.foreach_set("select", chosen[edges].all(axis=1))
    corners = foreach(mesh.loops, "vertex_index", 1, np.int32)
    starts = foreach(mesh.polygons, "loop_start", 1, np.int32)
    mesh.polygons.foreach_set("select", np.logical_and.reduceat(chosen[corners], starts))
    mesh.update()
    return int(hidden.sum())


def tell_unseen(report: Callable[[set[str], str], None], name: str, hidden: int, unseen: str | None) -> None:
    """Report why some of what was found cannot be seen in Edit Mode: hidden vertices, or the sentence on the object."""
    if unseen:
        report({"WARNING"}, unseen)
    if hidden:
        report({"WARNING"}, told(f"'{name}' has {hidden:,} more that are hidden: reveal them in Edit Mode (Alt H)"))
