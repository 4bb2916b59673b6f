"""Vertex groups: dense columns of weights, read by a geometry node tree and written by Blender's own conversion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from typing import Any

import bpy
import numpy as np
import numpy.typing as npt

from ...solver.surface.mesh import Booleans
from ..mesh_data import foreach
from .access import OWN_NAMES, Layer, numbered
from .carrier import Values


class VertexGroupAccess:
    """Vertex groups: weights in [0, 1] by name; a vertex of weight 0 is not a member."""

    domain = "POINT"

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the names of the groups."""
        return [group.name for group in obj.vertex_groups if group.name not in OWN_NAMES]

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the chosen vertex groups, each as a dense column of weights."""
        names = [name for name in self.names(obj) if chosen(name)]
        for name, column in zip(names, read_weights(obj, names).T, strict=True):
            yield Layer(name, column)

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str | None:
        """Return `name`, a numbered one if it is taken and `number` is given, or None if a locked group bears it."""
        group = obj.vertex_groups.get(name)
        if group is not None and number:
            return next(x for x in numbered(name) if x not in obj.vertex_groups and x not in reserved)
        return None if group is not None and group.lock_weight else name

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the weights of those of the groups that are there."""
        there = [name for name in names if name in obj.vertex_groups]
        return dict(zip(there, read_weights(obj, there).T, strict=True))

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the group or make it anew, at the end of the list; see `keep_order`."""
        groups = obj.vertex_groups
        weights = np.clip(values, 0, 1).astype(np.float32)
        active = groups.active.name if groups.active else None
        if (group := groups.get(name)) is not None:
            if not covered.all():
                weights[~covered] = read_weights(obj, [name])[~covered, 0]
            groups.remove(group)
        elif not covered.all():
            weights[~covered] = 0
        _new_group(obj, name, weights)
        if active is not None:
            groups.active = groups[active]


def read_weights(obj: bpy.types.Object, names: Sequence[str]) -> npt.NDArray[np.float32]:
    """Return the weight of every vertex in some vertex groups, (n, k); 0 where it is no member.

    Blender gives Python one vertex at a time; a geometry node tree on a passing object gives all at once, twenty times
    as fast.
    """
    if not names:
        return np.zeros((len(obj.data.vertices), 0), np.float32)
    mesh = obj.data
    reader = bpy.data.objects.new("Mobius Reader", mesh)
    if any(name in mesh.attributes for name in names):  # which the tree would find in place of the groups
        reader.data = mesh = mesh.copy()
        columns = [f"mobius {k}" for k in range(len(names))]
        for name, passing in zip(names, columns, strict=True):
            reader.vertex_groups[name].name = passing
        names = columns
    tree = _named_attributes_tree(names)
    try:
        bpy.context.scene.collection.objects.link(reader)
        modifier: Any = reader.modifiers.new("Mobius Reader", "NODES")
        modifier.node_group = tree
        evaluated = reader.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        read = [foreach(evaluated.attributes[f"read {k}"].data, "value", 1, np.float32) for k in range(len(names))]
    finally:
        bpy.data.objects.remove(reader)
        bpy.data.node_groups.remove(tree)
        if mesh != obj.data:
            bpy.data.meshes.remove(mesh)
    return np.stack(read, axis=1)


def keep_order(obj: bpy.types.Object, names: Sequence[str]) -> None:
    """Move vertex groups so that those of these names come first, in their order, and the others after them."""
    groups = obj.vertex_groups
    active = groups.active.name if groups.active else None
    with bpy.context.temp_override(object=obj, active_object=obj):
        for place, name in enumerate(name for name in names if name in groups):
            groups.active_index = groups[name].index
            for _ in range(groups.active_index - place):
                bpy.ops.object.vertex_group_move(direction="UP")
    if active is not None:
        groups.active = groups[active]


def _named_attributes_tree(names: Sequence[str]) -> bpy.types.NodeTree:
    """Return a geometry node tree that stores named attributes, vertex groups among them, under other names."""
    tree: Any = bpy.data.node_groups.new("Mobius Reader", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    for number, name in enumerate(names):
        named = tree.nodes.new("GeometryNodeInputNamedAttribute")
        named.data_type = "FLOAT"
        named.inputs["Name"].default_value = name
        store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
        store.data_type, store.domain = "FLOAT", "POINT"
        store.inputs["Name"].default_value = f"read {number}"
        tree.links.new(geometry, store.inputs["Geometry"])
        value = next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled)
        tree.links.new(next(socket for socket in named.outputs if socket.enabled), value)
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


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
