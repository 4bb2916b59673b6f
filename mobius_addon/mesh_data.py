"""Blender mesh objects as arrays: the triangles that Blender draws, and the way back to polygons and corners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
import numpy.typing as npt

from ..solver import TriangleMesh
from ..solver.surface.mesh import Floats, Integers


class Refusal(Exception):  # noqa: N818  (no error of the program)
    """An operation cannot be done as asked; the text is a sentence for the person who asked."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh object as the solver sees it.

    Attributes
    ----------
    mesh : TriangleMesh
        Vertices in the object's own space, as `seen_positions` has them, and Blender's triangulation of the polygons.
        An object whose scale mirrors it is mirrored here too (x negated, triangles turned round), so that left and
        right are what the person sees.
    rest : TriangleMesh
        The same in the shape that shape keys depart from; `mesh` itself unless a key is pinned.
    triangle_corners : (m, 3) int
        Index of the face corner (Blender's loop) at each corner of each triangle.
    corner_vertex : (c,) int
        Vertex of each face corner.
    corner_polygon : (c,) int
        Polygon of each face corner.
    edges : (e, 2) int
        Vertices of each of Blender's edges.
    keys : (n, 6) float64 or None
        Two mixtures of all shape keys: vertices that a key moves apart differ here. None without shape keys.
    """

    mesh: TriangleMesh
    rest: TriangleMesh
    triangle_corners: Integers
    corner_vertex: Integers
    corner_polygon: Integers
    edges: Integers
    keys: Floats | None = None


def foreach(collection: Any, name: str, width: int, dtype: type[np.generic]) -> np.ndarray:
    """Return one property of a Blender collection as an array, (len, width), or (len,) where width is 1."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def read_vertices(mesh: bpy.types.Mesh) -> Floats:
    """Return the vertex positions, (n, 3), in the mesh's own coordinates."""
    return foreach(mesh.vertices, "co", 3, np.float32).astype(np.float64)


def read_surface(obj: bpy.types.Object, name: str | None = None) -> Surface:
    """Return a mesh object as arrays.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object, not in Edit Mode. Its own mesh is read, without modifiers.
    name : str, optional
        What error messages call it; the object's name by default.

    Raises
    ------
    MeshError
        No vertices, no faces, or a position that is not finite.
    """
    mesh = obj.data
    mesh.calc_loop_triangles()
    shapes = [rest_positions(mesh), seen_positions(obj)]
    corner_vertex = foreach(mesh.loops, "vertex_index", 1, np.int32)
    corners = foreach(mesh.loop_triangles, "loops", 3, np.int32)
    corner_polygon = np.repeat(np.arange(len(mesh.polygons)), foreach(mesh.polygons, "loop_total", 1, np.int32))
    if is_mirrored(obj):
        for vertices in shapes:
            vertices[:, 0] *= -1
        corners = corners[:, ::-1]
    rest = seen = TriangleMesh(shapes[0], corner_vertex[corners], name or obj.name)
    if (shapes[1] != shapes[0]).any():
        seen = TriangleMesh(shapes[1], seen.faces, seen.name)
    edges = foreach(mesh.edges, "vertices", 2, np.int32).astype(np.intp)
    return Surface(
        seen, rest, corners.astype(np.intp), corner_vertex.astype(np.intp), corner_polygon, edges, _mixed_keys(mesh)
    )


def rest_positions(mesh: bpy.types.Mesh) -> Floats:
    """Return where Blender shows the vertices, (n, 3), with all shape keys at 0.

    Those of the first key, where there are keys: what `mesh.vertices` says may be out of step with it.
    """
    keys = mesh.shape_keys
    if keys is None or len(keys.reference_key.points) != len(mesh.vertices):
        return read_vertices(mesh)
    return foreach(keys.reference_key.points, "co", 3, np.float32).astype(np.float64)


def seen_positions(obj: bpy.types.Object) -> Floats:
    """Return the vertices of an object, (n, 3), in its own space: at rest, or in the one shape that is pinned."""
    places, key = rest_positions(obj.data), obj.active_shape_key
    if key is None or not obj.show_only_shape_key or key.mute or len(key.points) != len(places):
        return places
    pinned = foreach(key.points, "co", 3, np.float32).astype(np.float64)
    group = obj.vertex_groups.get(key.vertex_group)
    if group is not None:
        weight = [sum(x.weight for x in vertex.groups if x.group == group.index) for vertex in obj.data.vertices]
        pinned = places + np.array(weight)[:, None] * (pinned - places)
    return pinned


def _mixed_keys(mesh: bpy.types.Mesh) -> Floats | None:
    """Return two mixtures of the displacements of all shape keys, (n, 6), None without any."""
    blocks = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
    if len(blocks) < 2:
        return None
    rest = foreach(mesh.shape_keys.reference_key.data, "co", 3, np.float32).astype(np.float64)
    mixed = np.zeros((2, *rest.shape))
    shares = np.random.default_rng(0).uniform(0.5, 1.5, (len(blocks), 2, 1, 1))
    for share, block in zip(shares, blocks, strict=True):
        mixed += share * (foreach(block.data, "co", 3, np.float32) - rest)
    return np.concatenate([*mixed], axis=1)


def settle(context: bpy.types.Context) -> None:
    """Have objects be where they are: the redo panel undoes, and until they are evaluated anew all lie at the origin.

    An operator that reads a place, or whether an object is mirrored, begins with this.
    """
    context.view_layer.update()


def in_world(obj: bpy.types.Object) -> Floats:
    """Return the places of a mesh object's vertices in the world, (n, 3)."""
    own = read_vertices(obj.data)
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    return own @ matrix[:3, :3].T + matrix[:3, 3]


def is_mirrored(obj: bpy.types.Object) -> bool:
    """Return whether the object's transform turns left into right."""
    return obj.matrix_world.to_3x3().determinant() < 0


def mirrored(obj: bpy.types.Object, vectors: npt.NDArray[Any]) -> Floats:
    """Return vectors, (n, 3), between an object's own space and that of its `Surface`, either way."""
    return np.asarray(vectors * np.array([-1.0 if is_mirrored(obj) else 1.0, 1.0, 1.0]), dtype=np.float64)


def unseen_warning(obj: bpy.types.Object) -> str | None:
    """Return a sentence if an object looks other than what is read of it: a scale, sliders of keys, or modifiers."""
    return scale_warning(obj) or shape_warning(obj) or modifier_warning(obj)


_OTHER_SURFACE = ("ARRAY", "BOOLEAN", "BUILD", "EXPLODE", "MASK", "MIRROR", "SCREW", "SKIN")
"""Modifiers that, by what they are for, show more surface than the mesh has or less."""


def modifier_warning(obj: bpy.types.Object) -> str | None:
    """Return a sentence if modifiers show more surface of an object than is read of it, or less, else None."""
    shown = [modifier for modifier in obj.modifiers if modifier.show_viewport]
    found = [modifier for modifier in shown if modifier.type in _OTHER_SURFACE]
    if not found and {modifier.type for modifier in shown} in ({"NODES"}, {"NODES", "ARMATURE"}):
        # armatures keep the faces
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        if len(evaluated.data.polygons) != len(obj.data.polygons):
            found = [modifier for modifier in shown if modifier.type == "NODES"]
    if not found:
        return None
    names = ", ".join(f"'{modifier.name}'" for modifier in found)
    return f"'{obj.name}' counts without what its modifiers {names} show: apply them if that should count"


def shape_warning(obj: bpy.types.Object) -> str | None:
    """Return a sentence if shape keys show an object by more than 1 % of its diagonal off the shape that is read."""
    keys, places = obj.data.shape_keys, rest_positions(obj.data)
    if keys is None or obj.show_only_shape_key or not keys.use_relative:
        return None
    names, moved = [], np.zeros_like(places)
    for key in keys.key_blocks:
        if key != keys.reference_key and not key.mute and key.value and len(key.points) == len(places):
            names.append(key.name)
            apart = foreach(key.points, "co", 3, np.float32) - foreach(key.relative_key.points, "co", 3, np.float32)
            moved += key.value * apart
    if not names or not np.linalg.norm(moved, axis=1).max() > 0.01 * np.linalg.norm(np.ptp(places, axis=0)):
        return None
    shown = ", ".join(f"'{name}'" for name in names[:3]) + (", ..." if len(names) > 3 else "")
    return (
        f"'{obj.name}' counts in the shape of '{keys.reference_key.name}', without {shown}: "
        "to align it in another one, pin that shape key"
    )


def scale_warning(obj: bpy.types.Object) -> str | None:
    """Return a sentence if the object is stretched by a scale that its mesh does not have, else None."""
    scale = np.abs(obj.matrix_world.to_scale())
    if np.ptp(scale) > 1e-3 * scale.max():
        return (
            f"'{obj.name}' has different scales along its axes, which are ignored: apply the scale if it should count"
        )
    return None
