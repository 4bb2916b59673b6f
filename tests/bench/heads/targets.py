"""Targets with a truth: another person's head, triangulated, decimated, turned, scaled and moved."""

from dataclasses import dataclass

import numpy as np

from solver import TriangleMesh
from solver.surface.barycentric import interpolated
from solver.surface.nearest import SurfacePoints
from tests.solver.scans import similarity

from .people import Head

KEPT = 0.6


@dataclass(frozen=True, eq=False)
class Target:
    """A head to carry to, and where each of its vertices belongs.

    Attributes
    ----------
    mesh : TriangleMesh
    part : (n,) int
        The part of the head that each vertex was on.
    face, barycentric : (n,) int, (n, 3) float64
        The point of the head's own triangles that each vertex is nearest to, on that part.
    scale, turn, shift : float, (3, 3), (3,)
        What the head went through: scale * vertices @ turn + shift.
    """

    mesh: TriangleMesh
    part: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray
    scale: float
    turn: np.ndarray
    shift: np.ndarray

    def own(self, head: Head, displacements: np.ndarray) -> np.ndarray:
        """Return the displacements, (n, 3), that the head's own, (n_head, 3), are here."""
        there = interpolated(displacements, head.mesh.faces[self.face], self.barycentric)
        return self.scale * there @ self.turn


def decimated(head: Head, kept: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, triangles and their parts of a head after the collapse mode of Blender's Decimate modifier."""
    import bpy

    data = bpy.data.meshes.new("decimated")
    data.from_pydata(head.vertices.tolist(), [], np.split(head.corner, head.first[1:]))
    for part in range(int(head.part.max()) + 1):
        data.materials.append(bpy.data.materials.new(f"{part}"))
    data.polygons.foreach_set("material_index", head.part_of_polygon.astype(np.int32))
    thing = bpy.data.objects.new("decimated", data)
    bpy.context.scene.collection.objects.link(thing)
    thing.modifiers.new("triangulate", "TRIANGULATE")
    thing.modifiers.new("decimate", "DECIMATE").ratio = kept
    result = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    vertices = np.empty(3 * len(result.vertices), np.float32)
    result.vertices.foreach_get("co", vertices)
    faces = np.empty(3 * len(result.polygons), np.int32)
    result.polygons.foreach_get("vertices", faces)
    part = np.empty(len(result.polygons), np.int32)
    result.polygons.foreach_get("material_index", part)
    bpy.data.objects.remove(thing)
    for material in list(data.materials):
        bpy.data.materials.remove(material)
    bpy.data.meshes.remove(data)
    return vertices.reshape(-1, 3).astype(float), faces.reshape(-1, 3).astype(int), part.astype(int)


def target_of(head: Head, kept: float = KEPT, seed: int = 1) -> Target:
    """Return a head as a target."""
    vertices, faces, part_of_face = decimated(head, kept)
    part = np.full(len(vertices), -1)
    part[faces] = part_of_face[:, None]
    face, barycentric = np.full(len(vertices), -1), np.zeros((len(vertices), 3))
    normals = TriangleMesh(vertices, faces).vertex_normals()
    for k in range(int(head.part.max()) + 1):
        own = np.flatnonzero(head.part_of_triangle == k)
        rows = np.flatnonzero(part == k)
        surface = SurfacePoints(TriangleMesh(head.vertices, head.mesh.faces[own]), (), 0.0)
        at, barycentric[rows] = surface.nearest_point(vertices[rows], normals[rows], 12)
        face[rows] = own[at]
    scale, turn, shift = similarity(np.random.default_rng(seed))
    mesh = TriangleMesh(scale * vertices @ turn + shift, faces, f"{head.name} decimated")
    return Target(mesh, part, face, barycentric, scale, turn, shift)
