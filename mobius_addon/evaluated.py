"""A mesh object as its modifiers and the current mix of its shape keys show it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from ..solver import Correspondence, TriangleMesh
from ..solver.align.result.confidence import BOUND
from ..solver.carry.parts import pieces
from ..solver.surface.barycentric import interpolated
from ..solver.surface.mesh import Floats, Integers
from ..solver.surface.nearest import SurfacePoints
from .mesh_data import Refusal, Surface, foreach, mirrored, read_surface, seen_positions

_TRACE = "mobius_trace"
"""An attribute that modifiers carry along with the mesh: x, y, z of the original, and 1 to know it from what is new."""

SIDE = 0.01
"""A difference of 1 between unit normals counts like this share of the root of the area: enough to tell two sides."""


@dataclass(frozen=True, eq=False)
class Shown:
    """An evaluated mesh.

    Attributes
    ----------
    lent : bpy.types.Object
        An object that has it as its own mesh, with all layers, while the context lasts.
    surface : Surface
    origin : (n, 3) float64 or None
        Where on the original surface each vertex comes from, nan where it is new; None if vertex i is vertex i.
    """

    lent: bpy.types.Object
    surface: Surface
    origin: Floats | None

    @cached_property
    def _traced(self) -> tuple[SurfacePoints, Integers]:
        """The triangles with their vertices where these come from, but for new ones; and which triangles these are."""
        assert self.origin is not None
        mesh = self.surface.mesh
        kept = np.flatnonzero(np.isfinite(self.origin).all(axis=1)[mesh.faces].all(axis=1))
        traced = TriangleMesh(np.nan_to_num(self.origin), mesh.faces[kept], mesh.name)
        return SurfacePoints(traced, (), SIDE * np.sqrt(traced.area)), kept

    def through(self, found: Correspondence, original: Surface) -> Correspondence:
        """Return a correspondence with the original surface as one with the evaluated one.

        Each target vertex goes to the evaluated triangle that comes from its place on the original. One that comes from
        farther away than `BOUND` of the diagonal and its own size is no counterpart: a modifier has taken faces away.
        """
        if self.origin is None:
            return found
        traced, kept = self._traced
        located = np.flatnonzero(found.face >= 0)
        own = original.mesh
        places = interpolated(own.vertices, own.faces[found.face[located]], found.barycentric[located])
        normals = own.face_vectors[found.face[located]]
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
        there, weights = traced.most_alike(places, normals)
        reached = interpolated(traced.mesh.vertices, traced.mesh.faces[there], weights)
        # coarser triangles lie farther off
        reach = np.maximum(BOUND * own.diagonal, traced.mesh.edge_lengths[there].max(axis=1))
        near = np.linalg.norm(reached - places, axis=1) < reach
        face, barycentric = np.full(len(found.face), -1), np.zeros_like(found.barycentric)
        face[located[near]], barycentric[located[near]] = kept[there[near]], weights[near]
        return replace(
            found,
            face=face,
            barycentric=barycentric,
            matched=found.matched & (face >= 0),
            confidence=np.where(face >= 0, found.confidence, 0.0),
            source_triangles=self.surface.mesh.faces,
            source_size=len(self.origin),
            source_part=None if found.source_part is None else pieces(self.surface.mesh.faces, len(self.origin)),
        )


@contextmanager
def evaluated(obj: bpy.types.Object, original: Surface) -> Iterator[Shown]:
    """Lend an evaluated object; it is gone afterwards.

    Parameters
    ----------
    obj : bpy.types.Object
    original : Surface
        Its own mesh, without modifiers.

    Raises
    ------
    Refusal
        Blender does not evaluate the object, or what its modifiers have made does not tell where it comes from.
    """
    graph = bpy.context.evaluated_depsgraph_get()
    shown = obj.evaluated_get(graph)
    if not shown.is_evaluated:
        raise Refusal(f"'{obj.name}' is hidden, so Blender does not evaluate it: show it, or take the original mesh")
    with _lent(obj, shown, graph) as lent:
        if _same_elements(obj.data, lent.data):
            # in the triangles of the original, which Blender may cut otherwise there
            vertices = read_surface(lent).mesh.vertices
            mesh = TriangleMesh(vertices, original.mesh.faces, original.mesh.name)
            yield Shown(lent, replace(original, mesh=mesh, rest=mesh), None)
            return
    with _traced(obj) as twin:
        graph = bpy.context.evaluated_depsgraph_get()
        with _lent(obj, twin.evaluated_get(graph), graph) as lent:
            origin = _origin(lent)
            surface = read_surface(lent, obj.name)
            if not np.isfinite(origin).all(axis=1)[surface.mesh.faces].all(axis=1).any():
                names = ", ".join(f"'{modifier.name}'" for modifier in obj.modifiers if modifier.show_viewport)
                raise Refusal(
                    f"Modifiers of '{obj.name}' ({names}) make faces that do not tell where they come from: "
                    "apply them and align again, or take the original mesh"
                )
            yield Shown(lent, surface, mirrored(obj, origin))


@contextmanager
def _lent(obj: bpy.types.Object, shown: bpy.types.Object, graph: bpy.types.Depsgraph) -> Iterator[bpy.types.Object]:
    """Lend an object named like `obj`, with its transform and materials, that has the mesh of an evaluated one."""
    mesh = bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=graph)
    lent = bpy.data.objects.new(obj.name, mesh)
    try:
        lent.matrix_world = obj.matrix_world
        for slot, given in zip(lent.material_slots, obj.material_slots, strict=False):
            slot.material = given.material
        yield lent
    finally:
        bpy.data.objects.remove(lent)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)


@contextmanager
def _traced(obj: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Lend a copy of an object, in the scene, whose vertices bear their own positions as an attribute."""
    twin, mesh = obj.copy(), obj.data.copy()
    try:
        twin.data = mesh
        if _TRACE in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[_TRACE])
        trace = mesh.attributes.new(_TRACE, "FLOAT_COLOR", "POINT")
        places = np.ones((len(mesh.vertices), 4), np.float32)
        places[:, :3] = seen_positions(obj)
        trace.data.foreach_set("color", places.ravel())
        bpy.context.scene.collection.objects.link(twin)
        bpy.context.view_layer.update()
        yield twin
    finally:
        bpy.data.objects.remove(twin)
        bpy.data.meshes.remove(mesh)


def _origin(lent: bpy.types.Object) -> Floats:
    """Return where each vertex comes from, (n, 3), nan where it is new, and take the trace off the lent mesh."""
    mesh = lent.data
    trace = mesh.attributes.get(_TRACE)
    result = np.full((len(mesh.vertices), 3), np.nan)
    if trace is None or trace.domain != "POINT" or trace.data_type != "FLOAT_COLOR":
        return result
    values = foreach(trace.data, "color", 4, np.float32).astype(np.float64)
    old = np.abs(values[:, 3] - 1) < 1e-3
    result[old] = values[old, :3]
    mesh.attributes.remove(trace)
    return result


def _same_elements(mesh: bpy.types.Mesh, other: bpy.types.Mesh) -> bool:
    """Return whether two meshes have the same vertices, edges, polygons and corners, wherever the vertices are."""
    return all(
        len(x) == len(y) and np.array_equal(foreach(x, name, width, np.int32), foreach(y, name, width, np.int32))
        for x, y, name, width in (
            (mesh.polygons, other.polygons, "loop_total", 1),
            (mesh.loops, other.loops, "vertex_index", 1),
            (mesh.edges, other.edges, "vertices", 2),
        )
    ) and len(mesh.vertices) == len(other.vertices)
