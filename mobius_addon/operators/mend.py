"""Mend a mesh itself, by Blender's own operators: only when a person asks for it, in one step that undo takes back.

For the computation nothing of this is needed: `solver` mends what it reads, and the mesh stays as it is.
"""

# no postponed annotations here: Blender reads the properties from them
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import MeshError, TriangleMesh, topology
from ...solver.surface.joining import TOUCHING
from ...solver.surface.mesh import Booleans
from .. import viewport
from ..mesh_data import Refusal, foreach, read_surface, settle
from ..translation import told
from ..usable import why_not, why_not_object_mode
from .check import outside_largest_part, select_vertices


@dataclass(frozen=True)
class Remedy:
    """One way to mend a mesh: an item of the operator's choice.

    Attributes
    ----------
    identifier, label, description, icon : str
    """

    identifier: str
    label: str
    description: str
    icon: str


REMEDIES = (
    Remedy("fill", n_("Fill Openings"), n_("Close every opening but the largest by a face"), "MESH_PLANE"),
    Remedy("join", n_("Join Cut Edges"), n_("Merge vertices that lie in one place"), "AUTOMERGE_ON"),
    Remedy("largest", n_("Delete Smaller Parts"), n_("Keep the part of most vertices alone"), "OUTLINER_OB_MESH"),
    Remedy("inner", n_("Delete Inner Faces"), n_("Delete faces at whose edges others go on already"), "TRASH"),
    Remedy("cut", n_("Cut Along Seams"), n_("Cut the mesh open along its UV seams"), "MOD_EDGESPLIT"),
    Remedy("normals", n_("Turn Faces to One Side"), n_("Have all faces look outside"), "NORMALS_FACE"),
    Remedy("flip", n_("Flip Normals"), n_("Turn every face to its other side"), "UV_SYNC_SELECT"),
)


def remedy(how: str) -> Remedy:
    """Return a way to mend a mesh by its identifier."""
    return next(x for x in REMEDIES if x.identifier == how)


class MOBIUS_OT_mend(bpy.types.Operator):
    """Change the mesh itself, which the computation does not need. Undo takes it back."""

    bl_idname = "mobius.mend"
    bl_label = "Mend Mesh"
    bl_options = {"REGISTER", "UNDO"}

    object_name: bpy.props.StringProperty(
        name="Object", description="Mesh object to mend; the active object if empty", options={"SKIP_SAVE"}
    )
    how: bpy.props.EnumProperty(
        name="How",
        description="What is done to the mesh",
        items=tuple((x.identifier, x.label, x.description, x.icon, k) for k, x in enumerate(REMEDIES)),
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in Object Mode."""
        if reason := why_not_object_mode(context):
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Mend the mesh in Edit Mode and come back; what was selected is so again."""
        settle(context)
        obj: Any = bpy.data.objects.get(self.object_name) if self.object_name else context.object
        if reason := why_not(obj, "mesh", context.scene):
            self.report({"ERROR"}, reason)
            return {"CANCELLED"}
        before, selected = _counts(obj), _selection(obj.data)
        try:
            _mend(context, obj, self.how)
        except (Refusal, MeshError) as error:
            _select(obj.data, selected)
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        after = _counts(obj)
        if self.how not in ("normals", "flip") and after == before:
            _select(obj.data, selected)  # Blender takes no undo step of this
            self.report({"WARNING"}, rpt_("'{}' has nothing that this would change").format(obj.name))
            return {"CANCELLED"}
        label = rpt_(remedy(self.how).label)
        text = rpt_("'{}': {}; {:,} vertices and {:,} faces, before {:,} and {:,}")
        self.report({"INFO"}, text.format(obj.name, label, *after, *before))
        return {"FINISHED"}


def _counts(obj: bpy.types.Object) -> tuple[int, int]:
    return len(obj.data.vertices), len(obj.data.polygons)


def _selection(mesh: bpy.types.Mesh) -> list[Booleans]:
    """Return which vertices, edges and polygons of a mesh are selected."""
    return [foreach(elements, "select", 1, np.bool_) for elements in (mesh.vertices, mesh.edges, mesh.polygons)]


def _select(mesh: bpy.types.Mesh, selected: list[Booleans]) -> None:
    """Select what `_selection` has told."""
    for elements, chosen in zip((mesh.vertices, mesh.edges, mesh.polygons), selected, strict=True):
        elements.foreach_set("select", chosen)


def _mend(context: bpy.types.Context, obj: bpy.types.Object, how: str) -> None:
    """Mend a mesh in one way.

    Raises
    ------
    Refusal
        It cannot be edited here or without another one, something of it is hidden, or there is no seam to cut along.
    MeshError
        It cannot be read.
    """
    if how == "cut" and not foreach(obj.data.edges, "use_seam", 1, np.bool_).any():
        text = rpt_("'{}' has no seams: mark the edges to cut along in Edit Mode (Edge > Mark Seam)")
        raise Refusal(text.format(obj.name))
    own = obj.data
    if any(foreach(elements, "hide", 1, np.bool_).any() for elements in (own.vertices, own.edges, own.polygons)):
        # Edit Mode's tools leave it out: half of the faces would be turned, say
        text = rpt_("'{}' is hidden in part, which would not be mended: reveal it in Edit Mode (Alt H) first")
        raise Refusal(text.format(obj.name))
    mesh = read_surface(obj).mesh
    key = obj.active_shape_key_index
    selected, active = list(context.selected_objects), context.view_layer.objects.active
    _choose(own, mesh, how)
    # Edit Mode shows the active shape: where that closes lids or lips, they would be merged
    obj.active_shape_key_index = 0
    if reason := viewport.edit(context, obj, look=False):
        obj.active_shape_key_index = key
        raise Refusal(reason)
    tools = context.tool_settings
    kept = tuple(tools.mesh_select_mode)
    tools.mesh_select_mode = (False, True, False) if how == "cut" else (True, False, False)
    try:
        _STEPS[how](TOUCHING * mesh.diagonal)
    finally:
        tools.mesh_select_mode = kept
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.active_shape_key_index = key
        for other in context.view_layer.objects:
            other.select_set(other in selected)
        context.view_layer.objects.active = active


def _choose(own: bpy.types.Mesh, mesh: TriangleMesh, how: str) -> None:
    """Select what a way to mend works on; `mesh` is what `own` shows, vertex by vertex."""
    chosen = np.ones(len(mesh.vertices), bool)
    if how == "largest":
        chosen = outside_largest_part(mesh)
    elif how == "fill":
        found = topology(mesh)
        chosen[:] = False
        for k, loop in enumerate(found.boundary_loops):
            chosen[loop] |= k != np.argmax(found.loop_lengths)  # the longest is the rim of the surface
    select_vertices(own, chosen)
    if how == "cut":
        seams = foreach(own.edges, "use_seam", 1, np.bool_)
        for elements in (own.vertices, own.polygons):
            elements.foreach_set("select", np.zeros(len(elements), bool))
        own.edges.foreach_set("select", seams)
        ends = np.zeros(len(own.vertices), bool)
        ends[foreach(own.edges, "vertices", 2, np.int32)[seams]] = True
        own.vertices.foreach_set("select", ends)


def _delete_inner() -> None:
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.mesh.select_interior_faces()
    bpy.ops.mesh.delete(type="FACE")


# each is given the distance up to which vertices lie in one place
_STEPS: dict[str, Callable[[float], object]] = {
    "fill": lambda _: bpy.ops.mesh.fill_holes(sides=0),
    "join": lambda near: bpy.ops.mesh.remove_doubles(threshold=near),
    "largest": lambda _: bpy.ops.mesh.delete(type="VERT"),
    "inner": lambda _: _delete_inner(),
    "cut": lambda _: bpy.ops.mesh.edge_split(type="EDGE"),
    "normals": lambda _: bpy.ops.mesh.normals_make_consistent(inside=False),
    "flip": lambda _: bpy.ops.mesh.flip_normals(),
}
