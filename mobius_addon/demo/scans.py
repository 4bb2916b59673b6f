"""Two scans of Blender's own monkey head, and the exact correspondence between them.

The source is the head cut open at the back, a disc of quads. The target is the same head remeshed by voxels, thinned,
cut a little further in, laid onto the source's surface (which is where the ground truth comes from), then swollen,
bent, scaled, turned and moved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from scipy.spatial.transform import Rotation

from ...solver.surface.barycentric import weighted
from ...solver.surface.mesh import Floats, Integers
from ..mesh_data import foreach, read_vertices

SUBDIVISIONS = 2
VOXEL = 0.03
TARGET_VERTICES = 8000
# The opening is a plane behind the ears, tilted so that the underside goes with the back, and hollowed in the middle to
# pass between the ears. The target ends a little earlier, as a second scan of the same head would.
OPENING_NORMAL = Vector((0.0, 0.954, -0.3))
OPENING_HOLLOW = 0.2
SOURCE_OPENING = 0.27
TARGET_OPENING = 0.265


@dataclass(frozen=True)
class Similarity:
    """Scale, turn, move: ``points -> scale * rotation(points) + offset``."""

    scale: float
    rotation: Rotation
    offset: tuple[float, float, float]

    def __call__(self, points: Floats) -> Floats:
        """Return the moved points, (n, 3)."""
        return self.scale * self.rotation.apply(points) + np.asarray(self.offset)


# Where the second scanner put its origin and axes, and its unit.
POSE = Similarity(1.7, Rotation.from_euler("zxy", (35.0, 20.0, 130.0), degrees=True), (5.5, 0.8, 0.6))


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """For each target vertex the point of the source it was made from.

    Attributes
    ----------
    triangles : (m, 3) int
        Vertex indices of the source's triangles, in the order of its `loop_triangles`.
    face : (n,) int
        The triangle each target vertex was made from.
    barycentric : (n, 3) float64
        Where in that triangle.
    """

    triangles: Integers
    face: Integers
    barycentric: Floats

    def positions(self, source_vertices: Floats) -> Floats:
        """Return the true counterparts on the source, (n, 3), in the source's own coordinates."""
        corners = source_vertices[self.triangles[self.face]]
        return weighted(corners, self.barycentric)


@dataclass(frozen=True, eq=False)
class Scans:
    """The two meshes and what is known about them."""

    source: bpy.types.Mesh
    target: bpy.types.Mesh
    truth: GroundTruth


def build_scans() -> Scans:
    """Build both scans as meshes without any object."""
    head = subdivided(closed_head(), SUBDIVISIONS)
    source = cut_open(head, SOURCE_OPENING, "Source scan")
    other = remeshed(head, VOXEL, TARGET_VERTICES)
    target = cut_open(other, TARGET_OPENING, "Target scan")
    for mesh in (head, other):
        bpy.data.meshes.remove(mesh)
    truth = lay_onto(target, source)
    write_vertices(target, POSE(deform(truth.positions(read_vertices(source)))))
    return Scans(source, target, truth)


def deform(points: Floats) -> Floats:
    """Swell and bend the head, (n, 3) to (n, 3): smooth, nearly without stretch, and like no rigid motion."""
    points = swell(points, centre=(0.0, 0.0, 0.6), amount=0.1, width=0.6)
    for bend in BENDS:
        points = bend(points)
    return points


def swell(points: Floats, centre: tuple[float, float, float], amount: float, width: float) -> Floats:
    """Blow up by a factor of 1 + `amount` at `centre`, fading like a Gaussian of standard deviation `width`."""
    from_centre = points - np.asarray(centre)
    squared = np.einsum("nd,nd->n", from_centre, from_centre)
    return points + amount * np.exp(-squared / (2 * width**2))[:, None] * from_centre


@dataclass(frozen=True)
class Bend:
    """Curl the stretch of an axis from `start` to `end` into an arc; what lies beyond goes along, straight.

    Parameters
    ----------
    along, towards : int
        The axis that curls (0 to 2), and the one that it curls towards.
    start, end : float
        Where on the axis the arc begins and ends; `end` may be the smaller.
    angle : float
        How far it turns, in radians.
    neutral : float
        Where on the other axis lengths are kept.
    """

    along: int
    towards: int
    start: float
    end: float
    angle: float
    neutral: float

    def __call__(self, points: Floats) -> Floats:
        """Return the bent points, (n, 3)."""
        way = np.sign(self.end - self.start)
        curvature = self.angle / abs(self.end - self.start)
        length = way * (points[:, self.along] - self.start)
        arc = np.clip(length, 0, abs(self.end - self.start))
        beyond, off = length - arc, points[:, self.towards] - self.neutral
        sine, cosine = np.sin(curvature * arc), np.cos(curvature * arc)
        bent = points.copy()
        bent[:, self.along] = self.start + way * (sine / curvature + beyond * cosine - off * sine)
        bent[:, self.towards] = self.neutral + (1 - cosine) / curvature + beyond * sine + off * cosine
        return bent


# How the second scan differs: an ear turned forwards, the other laid back, the jaw down and to a side, the head curved.
BENDS = (
    Bend(along=0, towards=1, start=0.82, end=1.12, angle=-0.6, neutral=0.4),
    Bend(along=0, towards=1, start=-0.82, end=-1.12, angle=0.6, neutral=0.4),
    Bend(along=2, towards=0, start=-0.3, end=-0.8, angle=0.15, neutral=0.0),
    Bend(along=2, towards=1, start=-0.3, end=-0.8, angle=0.5, neutral=-0.5),
    Bend(along=2, towards=0, start=0.0, end=1.2, angle=0.3, neutral=0.0),
    Bend(along=2, towards=0, start=0.0, end=-1.2, angle=0.3, neutral=0.0),
)


def closed_head() -> bpy.types.Mesh:
    """Return the monkey's head without its separate eyes, the sockets closed by bulging lids: a closed surface."""
    shape = bmesh.new()
    bmesh.ops.create_monkey(shape)
    # The head is the part with the vertex farthest out: the tip of an ear.
    head = connected_vertices(max(shape.verts, key=lambda vertex: vertex.co.x))
    bmesh.ops.delete(shape, geom=[vertex for vertex in shape.verts if vertex not in head], context="VERTS")
    rims = [edge for edge in shape.edges if edge.is_boundary]
    lids = bmesh.ops.holes_fill(shape, edges=rims, sides=0)["faces"]
    for thickness, depth in ((0.05, 0.05), (0.08, 0.04)):
        bmesh.ops.inset_individual(shape, faces=lids, thickness=thickness, depth=depth)
    bmesh.ops.poke(shape, faces=lids, offset=0.02)
    return to_mesh(shape, "Head")


def connected_vertices(start: bmesh.types.BMVert) -> set[bmesh.types.BMVert]:
    """Return every vertex that edges connect with `start`."""
    reached = {start}
    front = [start]
    while front:
        vertex = front.pop()
        fresh = {edge.other_vert(vertex) for edge in vertex.link_edges} - reached
        reached |= fresh
        front.extend(fresh)
    return reached


def subdivided(mesh: bpy.types.Mesh, levels: int) -> bpy.types.Mesh:
    """Return the Catmull-Clark subdivision of `mesh`, which is removed."""

    def add(modifiers: bpy.types.ObjectModifiers) -> None:
        modifiers.new("Subdivision", "SUBSURF").levels = levels

    result = with_modifiers(mesh, add)
    bpy.data.meshes.remove(mesh)
    return result


def remeshed(mesh: bpy.types.Mesh, voxel: float, vertices: int) -> bpy.types.Mesh:
    """Return a triangulation of the closed `mesh` that shares no vertex with it: voxels, then edge collapses."""

    def add_remesh(modifiers: bpy.types.ObjectModifiers) -> None:
        remesh = modifiers.new("Remesh", "REMESH")
        remesh.mode = "VOXEL"
        remesh.voxel_size = voxel

    fine = with_modifiers(mesh, add_remesh)
    ratio = vertices / len(fine.vertices)

    def add_decimate(modifiers: bpy.types.ObjectModifiers) -> None:
        decimate = modifiers.new("Decimate", "DECIMATE")
        decimate.ratio = ratio
        decimate.use_collapse_triangulate = True

    coarse = with_modifiers(fine, add_decimate)
    bpy.data.meshes.remove(fine)
    return coarse


def with_modifiers(mesh: bpy.types.Mesh, add: Callable[[bpy.types.ObjectModifiers], None]) -> bpy.types.Mesh:
    """Return a copy of `mesh` with the modifiers applied that `add` puts on it, in a scene of its own."""
    scene = bpy.data.scenes.new("Workshop")
    carrier = bpy.data.objects.new("Workshop", mesh)
    scene.collection.objects.link(carrier)
    add(carrier.modifiers)
    layer = scene.view_layers[0]
    layer.update()
    result = bpy.data.meshes.new_from_object(carrier.evaluated_get(layer.depsgraph))
    bpy.data.objects.remove(carrier)
    bpy.data.scenes.remove(scene)
    return result


def cut_open(mesh: bpy.types.Mesh, distance: float, name: str) -> bpy.types.Mesh:
    """Return what lies before the opening at `distance` from the origin, under a new name."""
    shape = bmesh.new()
    shape.from_mesh(mesh)
    # Hollow the space out, cut by a plane, and put it back: the same as a cut by a hollow sheet.
    for vertex in shape.verts:
        vertex.co -= OPENING_HOLLOW * vertex.co.x**2 * OPENING_NORMAL
    # Vertices near the plane move onto it, so that the cut leaves no slivers.
    bmesh.ops.bisect_plane(
        shape,
        geom=[*shape.verts, *shape.edges, *shape.faces],
        dist=0.015,
        plane_co=distance * OPENING_NORMAL,
        plane_no=OPENING_NORMAL,
        use_snap_center=True,
        clear_outer=True,
    )
    for vertex in shape.verts:
        vertex.co += OPENING_HOLLOW * vertex.co.x**2 * OPENING_NORMAL
    return to_mesh(shape, name)


def lay_onto(mesh: bpy.types.Mesh, surface: bpy.types.Mesh) -> GroundTruth:
    """Find for each vertex of `mesh` the nearest point of `surface`; nothing is moved."""
    vertices = read_vertices(surface)
    surface.calc_loop_triangles()
    triangles = foreach(surface.loop_triangles, "vertices", 3, np.int32)
    tree = BVHTree.FromPolygons(vertices.tolist(), triangles.tolist(), all_triangles=True)
    nearest = [tree.find_nearest(vertex.co) for vertex in mesh.vertices]
    points = np.array([point for point, _, _, _ in nearest])
    face = np.array([index for _, _, index, _ in nearest], dtype=np.intp)
    return GroundTruth(triangles.astype(np.intp), face, barycentric(points, vertices[triangles[face]]))


def barycentric(points: Floats, corners: Floats) -> Floats:
    """Return the barycentric coordinates, (n, 3), of points (n, 3) in their triangles (n, 3, 3)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    offset = points - corners[:, 0]
    area = np.einsum("nd,nd->n", normal, normal)
    v = np.einsum("nd,nd->n", np.cross(offset, second), normal) / area
    w = np.einsum("nd,nd->n", np.cross(first, offset), normal) / area
    inside = np.clip(np.stack([1 - v - w, v, w], axis=1), 0, None)
    return inside / inside.sum(axis=1, keepdims=True)


def to_mesh(shape: bmesh.types.BMesh, name: str) -> bpy.types.Mesh:
    """Turn `shape`, which is freed, into a smooth shaded mesh."""
    mesh = bpy.data.meshes.new(name)
    for face in shape.faces:
        face.smooth = True
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def write_vertices(mesh: bpy.types.Mesh, positions: Floats) -> None:
    """Move every vertex."""
    mesh.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    mesh.update()
