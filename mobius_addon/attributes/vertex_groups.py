"""Vertex groups: read as dense columns of weights, written by Blender's own conversion."""

from __future__ import annotations

from collections.abc import Iterator, Set
from typing import Any

import bpy
import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from ...solver.mesh import Booleans
from .access import OWN_NAMES, Layer
from .carrier import Values


class VertexGroupAccess:
    """Vertex groups: weights in [0, 1] by name; a vertex of weight 0 is not a member."""

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read every vertex group as a dense column of weights."""
        names = [group.name for group in obj.vertex_groups]
        if not names:
            return
        vertices: list[int] = []
        groups: list[int] = []
        weights: list[float] = []
        for index, vertex in enumerate(obj.data.vertices):
            for element in vertex.groups:
                vertices.append(index)
                groups.append(element.group)
                weights.append(element.weight)
        known = np.array(groups, dtype=np.intp) < len(names)  # a damaged file can name groups that do not exist
        table = csc_array(
            (np.array(weights)[known], (np.array(vertices, np.intp)[known], np.array(groups, np.intp)[known])),
            shape=(len(obj.data.vertices), len(names)),
        )
        for index, name in enumerate(names):
            if name not in OWN_NAMES:
                yield Layer(name, table[:, [index]].toarray().ravel())

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str | None:
        """Return `name`, or None if a locked group bears it."""
        group = obj.vertex_groups.get(name)
        return None if group is not None and group.lock_weight else name

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the group or replace its weights."""
        group = obj.vertex_groups.get(name)
        weights = np.clip(values, 0, 1).astype(np.float32)
        if group is None:
            weights[~covered] = 0
            _new_group(obj, name, weights)
            return
        if covered.all():
            _replace_group(obj, group, weights)
            return
        group.remove(np.flatnonzero(covered).tolist())
        members = np.flatnonzero(covered & (weights > 0))
        levels, level_of = np.unique(weights[members], return_inverse=True)
        order = np.argsort(level_of, kind="stable")
        ends = np.searchsorted(level_of[order], np.arange(1, len(levels)))
        for weight, indices in zip(levels.tolist(), np.split(members[order], ends), strict=True):
            group.add(indices.tolist(), weight, "REPLACE")
        obj.data.update()


def _replace_group(obj: bpy.types.Object, group: bpy.types.VertexGroup, weights: npt.NDArray[np.float32]) -> None:
    """Make a vertex group anew in its place, which is faster than to set many different weights."""
    groups = obj.vertex_groups
    name, index, active = group.name, group.index, groups.active_index
    groups.remove(group)
    _new_group(obj, name, weights)
    groups.active_index = len(groups) - 1
    with bpy.context.temp_override(object=obj, active_object=obj):
        for _ in range(len(groups) - 1 - index):
            bpy.ops.object.vertex_group_move(direction="UP")
    groups.active_index = active


def _new_group(obj: bpy.types.Object, name: str, weights: npt.NDArray[np.float32]) -> None:
    """Make a vertex group of the positive weights.

    An attribute is converted, which takes a tenth of the time of `VertexGroup.add` for each vertex.
    """
    mesh = obj.data
    active = mesh.attributes.active.name if mesh.attributes.active else None
    temporary = mesh.attributes.new(name, "FLOAT", "POINT").name
    mesh.attributes[temporary].data.foreach_set("value", weights)
    mesh.attributes.active = mesh.attributes[temporary]
    with bpy.context.temp_override(object=obj, active_object=obj):
        bpy.ops.geometry.attribute_convert(mode="VERTEX_GROUP")
    obj.vertex_groups[-1].name = name
    if active is not None:
        mesh.attributes.active = mesh.attributes[active]
