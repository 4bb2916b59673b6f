"""The correspondence as attributes of the target, and node groups that sample the source through them, live.

The groups are built here, in the person's file and once for each type, rather than appended from a file that would come
with the extension: one code serves every version, and undo takes them away again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ..solver import Correspondence
from .attributes import LIVE_CONFIDENCE, LIVE_CORNERS, LIVE_FACE, LIVE_MATCHED, LIVE_NAMES, LIVE_WEIGHTS
from .mesh_data import Refusal, Surface


@dataclass(frozen=True)
class Sampled:
    """A type of attribute that can be sampled: its name, its type in nodes, whether it mixes, and how it is stored."""

    label: str
    node_type: str
    mixes: bool
    stored: str
    domain: str = "POINT"


SAMPLED = {
    "FLOAT": Sampled("Value", "FLOAT", True, "FLOAT"),
    "FLOAT_VECTOR": Sampled("Vector", "FLOAT_VECTOR", True, "FLOAT_VECTOR"),
    "FLOAT2": Sampled("UV Map", "FLOAT_VECTOR", True, "FLOAT2", "CORNER"),
    "FLOAT_COLOR": Sampled("Color", "FLOAT_COLOR", True, "FLOAT_COLOR"),
    "BYTE_COLOR": Sampled("Color", "FLOAT_COLOR", True, "FLOAT_COLOR"),
    "INT": Sampled("Integer", "INT", False, "INT"),
    "INT8": Sampled("Integer", "INT", False, "INT"),
    "BOOLEAN": Sampled("Flag", "BOOLEAN", False, "BOOLEAN"),
}
"""By Blender's type of attribute. Numbers with fractions are mixed by the weights, others come from the corner that
weighs most."""

_PREFIX = "Möbius Sample "


def write_map(target: bpy.types.Object, source: Surface, found: Correspondence) -> None:
    """Write the correspondence on the target's vertices: source polygon, three corners of it and weights, certainty.

    `source` is the source as it was aligned, whose triangles are those of the map. Vertices without a counterpart have
    polygon -1 and weights 0.
    """
    known = found.face >= 0
    corners = np.where(known[:, None], source.triangle_corners[found.face], 0)
    polygon = np.where(known, source.corner_polygon[corners[:, 0]], -1)
    values = {
        LIVE_FACE: ("INT", "value", polygon.astype(np.int32)),
        **{name: ("INT", "value", corners[:, k].astype(np.int32)) for k, name in enumerate(LIVE_CORNERS)},
        LIVE_WEIGHTS: ("FLOAT_VECTOR", "vector", found.barycentric.astype(np.float32)),
        LIVE_MATCHED: ("BOOLEAN", "value", found.matched),
        LIVE_CONFIDENCE: ("FLOAT", "value", found.confidence.astype(np.float32)),
    }
    attributes = target.data.attributes
    for name, (kind, field, content) in values.items():
        if name in attributes:
            attributes.remove(attributes[name])
        attributes.new(name, kind, "POINT")
        attributes[name].data.foreach_set(field, np.ascontiguousarray(content).ravel())
    target.data.update()


def type_on(source: bpy.types.Object, name: str) -> str:
    """Return Blender's type of what has a name on the source: a vertex group or an attribute of vertices or corners.

    Raises
    ------
    Refusal
        There is nothing of the name, or it cannot be sampled.
    """
    if name in source.vertex_groups:
        return "FLOAT"
    attribute = source.data.attributes.get(name)
    if attribute is None:
        raise Refusal(rpt_("'{}' has no attribute or vertex group '{}'").format(source.name, name))
    if attribute.data_type not in SAMPLED:
        raise Refusal(rpt_("'{}' is of a type that nodes cannot sample: use Transfer").format(name))
    return attribute.data_type


def sample_group(sampled: Sampled) -> bpy.types.GeometryNodeTree:
    """Return the node group that samples one type; it is made where the file does not have it yet."""
    name = _PREFIX + sampled.label
    group = bpy.data.node_groups.get(name)
    if group is not None and group.library is None and group.bl_idname == "GeometryNodeTree":
        return group
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    try:
        _fill(group, sampled)
    except BaseException:
        bpy.data.node_groups.remove(group)
        raise
    group.asset_mark()
    group.asset_data.description = "Samples an attribute of the source through the correspondence that Möbius found"
    return group


def add_modifier(target: bpy.types.Object, source: bpy.types.Object, name: str) -> bpy.types.Modifier:
    """Add a modifier that samples an attribute of the source live; one that does so already stays the only one.

    Raises
    ------
    Refusal
        As `type_on`; or the source follows the target.
    """
    if any(_is_ours(x) and _input_of(x, "Source") == target for x in source.modifiers):
        text = rpt_("'{}' follows '{}' already, and both cannot follow each other: remove that modifier first")
        raise Refusal(text.format(source.name, target.name))
    group = sample_group(SAMPLED[type_on(source, name)])
    title = f"{_PREFIX}'{name}'"
    modifier = target.modifiers.get(title) or target.modifiers.new(title, "NODES")
    modifier.node_group = group
    for label, value in (("Source", source), ("Attribute", name), ("Store As", name)):
        set_input(modifier, label, value)
    target.update_tag()
    return modifier


def remove_live(obj: bpy.types.Object) -> int:
    """Remove the correspondence and the modifiers that use it from an object, and return how many there were."""
    ours = [x for x in obj.modifiers if _is_ours(x)]
    names = [name for name in LIVE_NAMES if name in obj.data.attributes]
    for modifier in ours:
        obj.modifiers.remove(modifier)
    for name in names:
        obj.data.attributes.remove(obj.data.attributes[name])
    return len(ours) + bool(names)


def samplable(source: bpy.types.Object) -> list[str]:
    """Return the names of what can be sampled of a source."""
    found = [x.name for x in source.data.attributes if x.data_type in SAMPLED and not x.name.startswith(".")]
    return [*source.vertex_groups.keys(), *found]


def set_input(modifier: Any, label: str, value: Any) -> None:
    """Set an input of a node modifier by its name."""
    identifier = _identifier(modifier, label)
    if hasattr(modifier, "properties"):  # from 5.2 on
        getattr(modifier.properties.inputs, identifier).value = value
    else:
        modifier[identifier] = value


def _input_of(modifier: Any, label: str) -> Any:
    """Return an input of a node modifier by its name."""
    identifier = _identifier(modifier, label)
    return (
        getattr(modifier.properties.inputs, identifier).value
        if hasattr(modifier, "properties")
        else modifier[identifier]
    )


def _identifier(modifier: Any, label: str) -> str:
    sockets = [item for item in modifier.node_group.interface.items_tree if getattr(item, "in_out", "") == "INPUT"]
    return next(socket.identifier for socket in sockets if socket.name == label)


def _is_ours(modifier: Any) -> bool:
    """Return whether a modifier is one that `add_modifier` has added."""
    return modifier.type == "NODES" and modifier.node_group and modifier.node_group.name.startswith(_PREFIX)


def _fill(group: bpy.types.GeometryNodeTree, sampled: Sampled) -> None:
    """Build the nodes: three samples at corners of the source, mixed by their weights, stored under a name."""
    group.is_modifier = True
    face = group.interface
    face.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    face.new_socket("Source", in_out="INPUT", socket_type="NodeSocketObject")
    for label in ("Attribute", "Store As"):
        face.new_socket(label, in_out="INPUT", socket_type="NodeSocketString")
    only = face.new_socket("Only Matched", in_out="INPUT", socket_type="NodeSocketBool")
    only.description = "Leave out what corresponds to nothing with certainty"
    face.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes = _Nodes(group)
    given, result = nodes.add("NodeGroupInput", 0), nodes.add("NodeGroupOutput", 6)
    source = nodes.add("GeometryNodeObjectInfo", 1, transform_space="ORIGINAL")
    nodes.link(given.outputs["Source"], source.inputs["Object"])
    asked = nodes.add("GeometryNodeInputNamedAttribute", 1, data_type=sampled.node_type)
    nodes.link(given.outputs["Attribute"], asked.inputs["Name"])
    weights = nodes.add("ShaderNodeSeparateXYZ", 2)
    nodes.link(nodes.attribute(LIVE_WEIGHTS, "FLOAT_VECTOR"), weights.inputs[0])
    samples = []
    for name in LIVE_CORNERS:
        # what is on vertices is on corners too: each has its vertex's value
        sample = nodes.add("GeometryNodeSampleIndex", 3, data_type=sampled.node_type, domain="CORNER")
        nodes.link(source.outputs["Geometry"], sample.inputs["Geometry"])
        nodes.link(nodes.value(asked), nodes.input(sample, "Value"))
        nodes.link(nodes.attribute(name, "INT"), sample.inputs["Index"])
        samples.append(nodes.value(sample))
    mix = nodes.mixed if sampled.mixes else nodes.heaviest
    values = mix(samples, list(weights.outputs), sampled)
    store = nodes.add("GeometryNodeStoreNamedAttribute", 5, data_type=sampled.stored, domain=sampled.domain)
    nodes.link(given.outputs["Geometry"], store.inputs["Geometry"])
    nodes.link(given.outputs["Store As"], store.inputs["Name"])
    nodes.link(values, nodes.input(store, "Value"))
    nodes.link(nodes.chosen(given.outputs["Only Matched"]), store.inputs["Selection"])
    nodes.link(store.outputs["Geometry"], result.inputs["Geometry"])


class _Nodes:
    """The nodes of a group while it is built."""

    def __init__(self, group: bpy.types.GeometryNodeTree) -> None:
        self.group = group
        self.rows: dict[int, int] = {}

    def add(self, kind: str, column: int, **settings: Any) -> Any:
        """Add a node below the last one of its column."""
        node = self.group.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        row = self.rows[column] = self.rows.get(column, -1) + 1
        node.location = 220 * column, -220 * row
        return node

    def link(self, output: Any, end: Any) -> None:
        """Link two sockets."""
        self.group.links.new(output, end)

    def attribute(self, name: str, kind: str) -> Any:
        """Return the socket of a named attribute of the target."""
        node = self.add("GeometryNodeInputNamedAttribute", 1, data_type=kind)
        node.inputs["Name"].default_value = name
        return self.value(node)

    def input(self, node: Any, name: str) -> Any:
        """Return the input of a name that is in use for the node's type: some nodes have one for each type."""
        return next(x for x in node.inputs if x.name == name and x.enabled)

    def value(self, node: Any) -> Any:
        """Return the first output that is in use for the node's type."""
        return next(x for x in node.outputs if x.enabled)

    def math(self, operation: str, *given: Any) -> Any:
        """Return the result of arithmetic on sockets and numbers."""
        node = self.add("ShaderNodeMath", 4, operation=operation)
        for end, value in zip(node.inputs, given, strict=False):
            if isinstance(value, int | float):
                end.default_value = value
            else:
                self.link(value, end)
        return node.outputs[0]

    def weighted(self, numbers: list[Any], weights: list[Any]) -> Any:
        """Return the sum of three numbers by weights."""
        parts = [self.math("MULTIPLY", *pair) for pair in zip(numbers, weights, strict=True)]
        return self.math("ADD", self.math("ADD", parts[0], parts[1]), parts[2])

    def mixed(self, samples: list[Any], weights: list[Any], sampled: Sampled) -> Any:
        """Return the mean of samples by weights."""
        if sampled.node_type == "FLOAT":
            return self.weighted(samples, weights)
        if sampled.node_type == "FLOAT_COLOR":
            return self._mixed_colors(samples, weights)
        total = None
        for sample, weight in zip(samples, weights, strict=True):
            scaled = self.add("ShaderNodeVectorMath", 4, operation="SCALE")
            self.link(sample, scaled.inputs[0])
            self.link(weight, scaled.inputs["Scale"])
            if total is None:
                total = scaled.outputs[0]
                continue
            added = self.add("ShaderNodeVectorMath", 4, operation="ADD")
            self.link(total, added.inputs[0])
            self.link(scaled.outputs[0], added.inputs[1])
            total = added.outputs[0]
        return total

    def _mixed_colors(self, samples: list[Any], weights: list[Any]) -> Any:
        """Return the mean of colors, each channel by itself: nodes that mix colors leave out the alpha."""
        parts = []
        for sample in samples:
            parts.append(self.add("FunctionNodeSeparateColor", 4))
            self.link(sample, parts[-1].inputs[0])
        whole = self.add("FunctionNodeCombineColor", 4)
        for channel, end in enumerate(whole.inputs):
            self.link(self.weighted([part.outputs[channel] for part in parts], weights), end)
        return whole.outputs[0]

    def heaviest(self, samples: list[Any], weights: list[Any], sampled: Sampled) -> Any:
        """Return the sample of the largest weight."""
        second = self.math("GREATER_THAN", weights[1], weights[0])
        larger = self.math("MAXIMUM", weights[0], weights[1])
        third = self.math("GREATER_THAN", weights[2], larger)
        return self._switch(third, self._switch(second, samples[0], samples[1], sampled), samples[2], sampled)

    def _switch(self, which: Any, no: Any, yes: Any, sampled: Sampled) -> Any:
        node = self.add("GeometryNodeSwitch", 4, input_type=sampled.node_type)
        ends = [x for x in node.inputs if x.enabled]
        for value, end in zip((which, no, yes), ends, strict=True):
            self.link(value, end)
        return self.value(node)

    def chosen(self, only_matched: Any) -> Any:
        """Return which vertices get a value: those with a counterpart, or with a certain one alone."""
        compare = self.add("FunctionNodeCompare", 4, data_type="INT", operation="GREATER_EQUAL")
        ends = [x for x in compare.inputs if x.enabled]
        self.link(self.attribute(LIVE_FACE, "INT"), ends[0])
        either = self.add("FunctionNodeBooleanMath", 4, operation="NOT")
        self.link(only_matched, either.inputs[0])
        matched = self.add("FunctionNodeBooleanMath", 4, operation="OR")
        self.link(either.outputs[0], matched.inputs[0])
        self.link(self.attribute(LIVE_MATCHED, "BOOLEAN"), matched.inputs[1])
        both = self.add("FunctionNodeBooleanMath", 4, operation="AND")
        self.link(compare.outputs[0], both.inputs[0])
        self.link(matched.outputs[0], both.inputs[1])
        return both.outputs[0]
