"""A mesh object as its modifiers and the current mix of its shape keys show it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy
import numpy as np

from ..solver import TriangleMesh
from .mesh_data import Refusal, Surface, foreach, read_surface


@contextmanager
def evaluated(obj: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Lend an object that has the evaluated mesh as its own, with all layers; it is gone afterwards.

    Raises
    ------
    Refusal
        Blender does not evaluate the object, or its modifiers change what the mesh is made of.
    """
    graph = bpy.context.evaluated_depsgraph_get()
    shown = obj.evaluated_get(graph)
    if not shown.is_evaluated:
        raise Refusal(f"'{obj.name}' is hidden, so Blender does not evaluate it: show it, or take the original mesh")
    mesh = bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=graph)
    lent = bpy.data.objects.new(obj.name, mesh)
    try:
        if not _same_elements(obj.data, mesh):
            names = ", ".join(f"'{modifier.name}'" for modifier in obj.modifiers if modifier.show_viewport)
            raise Refusal(
                f"Modifiers of '{obj.name}' ({names}) change its faces: apply them and align again, "
                "or take the original mesh"
            )
        lent.matrix_world = obj.matrix_world
        for slot, given in zip(lent.material_slots, obj.material_slots, strict=False):
            slot.material = given.material
        yield lent
    finally:
        bpy.data.objects.remove(lent)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)


def evaluated_surface(lent: bpy.types.Object, original: Surface) -> Surface:
    """Return the surface of a lent object in the triangles of the original, which Blender may cut otherwise there."""
    vertices = read_surface(lent).mesh.vertices
    return replace(original, mesh=TriangleMesh(vertices, original.mesh.faces, original.mesh.name))


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
