"""Pairs of points that the user knows in a scene: empties, or vertex groups of one vertex."""

from __future__ import annotations

import re

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


def paired_empties(
    source: bpy.types.Object, target: bpy.types.Object
) -> dict[str, tuple[bpy.types.Object, bpy.types.Object]]:
    """Return the empties parented to two objects that have equal names, a number like .001 at the end aside."""
    one, other = _named_empties(source), _named_empties(target)
    return {name: (one[name], other[name]) for name in one if name in other}


def _named_empties(obj: bpy.types.Object) -> dict[str, bpy.types.Object]:
    """Return the empties parented to an object by their names; of several that have one name, the first."""
    children = sorted(obj.children, key=lambda child: child.name, reverse=True)
    return {re.sub(r"\.\d{3,}$", "", child.name): child for child in children if child.type == "EMPTY"}


def _empties(obj: bpy.types.Object) -> dict[str, Floats]:
    """Return where the empties parented to an object are, by their names, in the space of its surface."""
    inverse = obj.matrix_world.inverted_safe()
    return {
        name: mirrored(obj, np.array(inverse @ Vector(child.matrix_world.translation)))
        for name, child in _named_empties(obj).items()
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
