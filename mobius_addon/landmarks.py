"""Pairs of points that the user knows: empties, vertex groups of one vertex, or a file."""

from __future__ import annotations

import re
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from scipy.spatial import KDTree

from ..solver import TriangleMesh
from ..solver.surface.mesh import Floats, Integers
from .mesh_data import Refusal, mirrored

NONE = np.empty((0, 2), np.intp)


def from_scene(
    source: bpy.types.Object, target: bpy.types.Object, meshes: tuple[TriangleMesh, TriangleMesh], by: str
) -> Integers:
    """Return the (source vertex, target vertex) rows, (l, 2), of landmarks on both objects with equal names.

    Parameters
    ----------
    source, target : bpy.types.Object
    meshes : (TriangleMesh, TriangleMesh)
        Their surfaces.
    by : str
        "none"; "empties": those parented to the objects, a number like .001 at the end aside, each the nearest vertex;
        "groups": vertex groups with one vertex.

    Raises
    ------
    Refusal
        There are none.
    """
    if by == "none":
        return NONE
    if by == "empties":
        places = [_empties(obj) for obj in (source, target)]
        named = [
            dict(zip(at, _nearest(mesh, list(at.values())), strict=True))
            for at, mesh in zip(places, meshes, strict=True)
        ]
        what = "empties parented to them"
    else:
        named = [_single_vertices(obj) for obj in (source, target)]
        what = "vertex groups of one vertex"
    common = sorted(named[0].keys() & named[1].keys())
    if not common:
        raise Refusal(
            f"'{source.name}' and '{target.name}' have no {what} with equal names: add some, or turn landmarks off"
        )
    return np.array([[side[name] for side in named] for name in common], np.intp)


def from_file(path: Path, meshes: tuple[TriangleMesh, TriangleMesh]) -> Integers:
    """Return the (source vertex, target vertex) rows, (l, 2), of a text file.

    Each line has two vertex numbers, or six coordinates: a point on the source and one on the target, each standing for
    the nearest vertex. Commas, semicolons and spaces separate; what follows # is a remark.

    Raises
    ------
    OSError
        The file cannot be read.
    Refusal
        It is no such file, or has no line.
    """
    rows = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        words = re.split(r"[,;\s]+", line.split("#")[0].strip())
        if words == [""]:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) == 2 and all(value.is_integer() for value in values):
            rows.append([int(value) for value in values])
        elif len(values) == 6 and np.isfinite(values).all():
            points = [np.array(values[:3]), np.array(values[3:])]
            rows.append([_nearest(mesh, [at])[0] for mesh, at in zip(meshes, points, strict=True)])
        else:
            raise Refusal(f"'{path}', line {number}: give two vertex numbers, or a point of each mesh by x y z")
    if not rows:
        raise Refusal(f"'{path}' holds no landmarks: give a pair on each line")
    pairs = np.array(rows, np.intp)
    for column, mesh in zip(pairs.T, meshes, strict=True):
        if column.min() < 0 or column.max() >= len(mesh.vertices):
            raise Refusal(f"'{path}' names vertices that '{mesh.name}' lacks: it has 0 to {len(mesh.vertices) - 1:,}")
    return pairs


def _empties(obj: bpy.types.Object) -> dict[str, Floats]:
    """Return where the empties parented to an object are, by their names, in the space of its surface."""
    inverse = obj.matrix_world.inverted_safe()
    return {
        re.sub(r"\.\d{3,}$", "", child.name): mirrored(obj, np.array(inverse @ Vector(child.matrix_world.translation)))
        for child in sorted(obj.children, key=lambda child: child.name, reverse=True)
        if child.type == "EMPTY"
    }


def _single_vertices(obj: bpy.types.Object) -> dict[str, int]:
    """Return the vertex of each vertex group that has exactly one."""
    found: dict[str, list[int]] = {}
    for vertex in obj.data.vertices:
        for member in vertex.groups:
            if member.weight > 0:
                found.setdefault(obj.vertex_groups[member.group].name, []).append(vertex.index)
    return {name: indices[0] for name, indices in found.items() if len(indices) == 1}


def _nearest(mesh: TriangleMesh, points: list[Floats]) -> list[int]:
    """Return the vertex in a face that is nearest to each point."""
    if not points:
        return []
    used = np.unique(mesh.faces)
    return [int(k) for k in used[KDTree(mesh.vertices[used]).query(np.array(points))[1]]]
