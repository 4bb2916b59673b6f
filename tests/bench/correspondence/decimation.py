"""Other triangles: Blender's edge collapse, as a user's low resolution copy would have it, and vertices elsewhere."""

from collections.abc import Callable
from typing import Any

import numpy as np

from solver import TriangleMesh, topology
from solver.surface.barycentric import weighted


def decimated(mesh: TriangleMesh, share: float) -> TriangleMesh:
    """Return the mesh with that share of its triangles, by the collapse mode of Blender's Decimate modifier."""

    def collapse(modifiers: Any) -> None:
        modifier = modifiers.new("decimate", "DECIMATE")
        modifier.ratio = share
        modifier.use_collapse_triangulate = True

    return _modified(mesh, collapse)


def resized(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """Return the mesh with about that many triangles, subdivided smoothly where it has fewer, then collapsed."""

    def subdivide(modifiers: Any) -> None:
        modifiers.new("subdivide", "SUBSURF").levels = 1
        modifiers.new("triangulate", "TRIANGULATE")

    while len(mesh.faces) < triangles:
        mesh = _modified(mesh, subdivide)
    return decimated(mesh, triangles / len(mesh.faces))


def _modified(mesh: TriangleMesh, modify: Callable[[Any], None]) -> TriangleMesh:
    """Return the mesh as Blender's modifiers, which `modify` adds to a stack, make it."""
    import bpy  # takes a second, and is not needed where the result is kept

    size = 1 / np.sqrt(mesh.area)  # Blender's positions are single precision
    middle = mesh.vertices.mean(axis=0)
    data = bpy.data.meshes.new("decimated")
    data.from_pydata(((mesh.vertices - middle) * size).tolist(), [], mesh.faces.tolist())
    thing = bpy.data.objects.new("decimated", data)
    bpy.context.scene.collection.objects.link(thing)
    modify(thing.modifiers)
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    result = evaluated.to_mesh()
    vertices = np.empty(3 * len(result.vertices), np.float32)
    result.vertices.foreach_get("co", vertices)
    faces = np.empty(3 * len(result.polygons), np.int32)
    result.polygons.foreach_get("vertices", faces)
    evaluated.to_mesh_clear()
    bpy.data.objects.remove(thing)
    bpy.data.meshes.remove(data)
    return TriangleMesh(vertices.reshape(-1, 3).astype(float) / size + middle, faces.reshape(-1, 3), mesh.name)


def moved(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Return the mesh with each vertex inside up to half way to a random point of a triangle around it.

    An edge collapse leaves most vertices where they are. Surfaces of one template then have vertices in common, which
    tell a method that pairs vertices what it is to find; two scans have none. A vertex around which a triangle would
    turn by more than a right angle, or nearly lose its area, moves half as far, until none does.
    """
    rng = np.random.default_rng(seed)
    side = rng.permutation(mesh.faces.size)
    around = np.zeros(len(mesh.vertices), np.intp)
    around[mesh.faces.ravel()[side]] = side // 3
    share = rng.dirichlet(np.ones(3), len(mesh.vertices))
    for loop in topology(mesh).boundary_loops:  # none where it is closed
        share[loop] = 0
    corners = mesh.vertices[mesh.faces[around]]
    shift = weighted(corners - mesh.vertices[:, None], share) / 2
    for _ in range(12):
        result = TriangleMesh(mesh.vertices + shift, mesh.faces, mesh.name)
        along = (result.face_vectors * mesh.face_vectors).sum(axis=1)
        bad = along < 0.05 * (mesh.face_vectors**2).sum(axis=1)
        if not bad.any():
            return result
        shift[np.unique(mesh.faces[bad])] /= 2
    shift[np.unique(mesh.faces[bad])] = 0
    return TriangleMesh(mesh.vertices + shift, mesh.faces, mesh.name)
