"""A mesh out of arrays, for the kinds of files that Blender itself does not read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...solver.surface.mesh import Floats, Integers
from .nowhere import are_places
from .unreadable import Unreadable, no_numbers


@dataclass(frozen=True, eq=False)
class Polygons:
    """What a file holds.

    Attributes
    ----------
    vertices : (n, 3) float64
    corners : (c,) int
        The vertices of all polygons, one after the other.
    sizes : (p,) int
        How many of them each polygon has.
    """

    vertices: Floats
    corners: Integers
    sizes: Integers


def put_into_scene(polygons: Polygons, path: Path) -> bpy.types.Mesh:
    """Add an object, named like the file, with these polygons as they are, and return its mesh.

    No axis is turned, nothing is scaled.

    Raises
    ------
    Unreadable
        A polygon has a vertex that is not there, or a vertex is at no place.
    """
    # Blender would take them for 0
    if (wrong := np.flatnonzero(~are_places(polygons.vertices).all(axis=1))).size:
        raise no_numbers(path, wrong.size, f"vertex {wrong[0]:,}")
    count = len(polygons.vertices)
    outside = (polygons.corners < 0) | (polygons.corners >= count)
    if outside.any():
        gone = int(polygons.corners[outside][0])
        raise Unreadable(f"'{path}' is damaged: a polygon has vertex {gone:,}, but there are {count:,}, from 0")
    kept = polygons.sizes >= 3  # points and lines among them
    corners = polygons.corners[np.repeat(kept, polygons.sizes)]
    sizes = polygons.sizes[kept]
    mesh = bpy.data.meshes.new(path.stem)
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", polygons.vertices.astype(np.float32).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32))
    mesh.polygons.add(len(sizes))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
    mesh.update(calc_edges=True)
    mesh.validate()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(path.stem, mesh))
    return mesh
