"""Blender mesh objects as arrays: the triangles that Blender draws, and the way back to polygons and corners."""

from __future__ import annotations

import hashlib
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
        Vertices in the object's own space and Blender's triangulation of the polygons. An object whose scale mirrors it
        is mirrored here too (x negated, triangles turned round), so that left and right are what the person sees.
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
    triangle_corners: Integers
    corner_vertex: Integers
    corner_polygon: Integers
    edges: Integers
    keys: Floats | None = None

    def fingerprint(self) -> str:
        """Return a hash of vertices and triangles, which any edit of the shape changes."""
        digest = hashlib.blake2b(digest_size=16)
        digest.update(self.mesh.vertices.astype(np.float32).tobytes())
        digest.update(self.mesh.faces.astype(np.int32).tobytes())
        return digest.hexdigest()


def foreach(collection: Any, name: str, width: int, dtype: type[np.generic]) -> np.ndarray:
    """Return one property of a Blender collection as an array, (len, width), or (len,) where width is 1."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


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
    vertices = foreach(mesh.vertices, "co", 3, np.float32).astype(np.float64)
    corner_vertex = foreach(mesh.loops, "vertex_index", 1, np.int32)
    corners = foreach(mesh.loop_triangles, "loops", 3, np.int32)
    corner_polygon = np.repeat(np.arange(len(mesh.polygons)), foreach(mesh.polygons, "loop_total", 1, np.int32))
    if is_mirrored(obj):
        vertices[:, 0] *= -1
        corners = corners[:, ::-1]
    triangles = TriangleMesh(vertices, corner_vertex[corners], name or obj.name)
    edges = foreach(mesh.edges, "vertices", 2, np.int32).astype(np.intp)
    indices = corners.astype(np.intp), corner_vertex.astype(np.intp)
    return Surface(triangles, *indices, corner_polygon, edges, _mixed_keys(mesh))


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


def is_mirrored(obj: bpy.types.Object) -> bool:
    """Return whether the object's transform turns left into right."""
    return obj.matrix_world.to_3x3().determinant() < 0


def mirrored(obj: bpy.types.Object, vectors: npt.NDArray[Any]) -> Floats:
    """Return vectors, (n, 3), between an object's own space and that of its `Surface`, either way."""
    return np.asarray(vectors * np.array([-1.0 if is_mirrored(obj) else 1.0, 1.0, 1.0]), dtype=np.float64)


def scale_warning(obj: bpy.types.Object) -> str | None:
    """Return a sentence if the object is stretched by a scale that its mesh does not have, else None."""
    scale = np.abs(obj.matrix_world.to_scale())
    if np.ptp(scale) > 1e-3 * scale.max():
        return (
            f"'{obj.name}' has different scales along its axes, which are ignored: apply the scale if it should count"
        )
    return None
