"""What the nodes of a material show: which picture, which of its channels, and how it lies on the surface."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...solver.carry.textures import CLIP, EXTEND, MIRROR, REPEAT
from ...solver.surface.mesh import Floats
from ..attributes.access import OWN_NAMES

_SHADERS = ("BSDF_PRINCIPLED", "EMISSION", "BSDF_DIFFUSE", "BACKGROUND", "BSDF_TOON", "BSDF_GLOSSY")
"""Shaders that say what color a surface has, the most telling first."""

_WRAPS = {"REPEAT": REPEAT, "EXTEND": EXTEND, "CLIP": CLIP, "MIRROR": MIRROR}


@dataclass(frozen=True)
class Channel:
    """One of the things that pictures of a material say.

    Attributes
    ----------
    identifier, label : str
    sockets : tuple of str
        Inputs of shaders that it goes to, where they have it.
    color : bool
        A color, not numbers.
    value : tuple of float
        What stands for it where a material says nothing.
    """

    identifier: str
    label: str
    sockets: tuple[str, ...]
    color: bool
    value: tuple[float, ...]


CHANNELS = (
    Channel("base_color", "Base Color", ("Base Color", "Color"), True, (0.8, 0.8, 0.8)),
    Channel("roughness", "Roughness", ("Roughness",), False, (0.5,)),
    Channel("metallic", "Metallic", ("Metallic",), False, (0.0,)),
    Channel("normal", "Normal", ("Normal",), False, (0.5, 0.5, 1.0)),
    Channel("height", "Height", ("Normal",), False, (0.5,)),
    Channel("alpha", "Alpha", ("Alpha",), False, (1.0,)),
    Channel("emission", "Emission", ("Emission Color", "Emission"), True, (0.0, 0.0, 0.0)),
)


@dataclass(frozen=True, eq=False)
class Found:
    """What a material shows in a channel.

    Attributes
    ----------
    image : bpy.types.Image or None
    attribute : str or None
        A color attribute instead.
    part : str
        "RGB", or one of "R", "G", "B", "A".
    uv_map : str
        The UV map it lies in; empty: the one that is rendered.
    matrix : (2, 3) float64
        From the UV map to the picture.
    wrap : int
    settings : tuple of (str, float)
        Inputs of the node that reads it: strength, distance.
    passed : tuple of str
        Names of nodes on the way whose effect is not carried.
    """

    image: Any
    attribute: str | None
    part: str
    uv_map: str
    matrix: Floats
    wrap: int
    settings: tuple[tuple[str, float], ...] = ()
    passed: tuple[str, ...] = ()


Place = tuple[Any, tuple[Any, ...]]
"""A socket, and the group nodes that it is inside of."""


def own_colors(obj: bpy.types.Object) -> str:
    """Return the color attribute that is rendered where there is no material; empty for none, or one of ours."""
    name = obj.data.attributes.default_color_name
    return "" if name in OWN_NAMES else name


def picture_count(obj: bpy.types.Object) -> int:
    """Return how many pictures an object's materials have, quickly; without a material 1 for its colors, if any."""
    materials = [slot.material for slot in obj.material_slots if slot.material is not None]
    if not materials:
        return int(bool(own_colors(obj)))
    trees = [x.node_tree for x in materials if x.node_tree is not None]
    images = set()
    for tree in trees:  # grows by the groups in it
        for node in tree.nodes:
            if node.type == "TEX_IMAGE" and node.image is not None:
                images.add(node.image)
            elif node.type == "GROUP" and node.node_tree is not None and node.node_tree not in trees:
                trees.append(node.node_tree)
    return len(images)


def shader_of(material: bpy.types.Material) -> Any:
    """Return the node that says how a material looks; None if there is none that is known."""
    place = _shader(material)
    return None if place is None else place[0]


def found_in(material: bpy.types.Material, channel: Channel) -> Found | None:
    """Return the picture or color attribute that a material shows in a channel, or None."""
    place = _shader(material)
    if place is None:
        return None
    node, groups = place
    found = None
    for name in channel.sockets:
        socket = node.inputs.get(name)
        if socket is not None and (socket.is_linked or found is None):
            found = _traced(socket, groups, channel)
            break
    if found is None and channel.identifier == "height":
        output = _output(material)
        if output is not None:
            found = _traced(output.inputs["Displacement"], (), channel)
    return found


def value_of(material: bpy.types.Material | None, channel: Channel) -> Floats:
    """Return the value that a material has in a channel where it shows no picture."""
    place = None if material is None else _shader(material)
    if place is not None and channel.identifier not in ("normal", "height"):
        for name in channel.sockets:
            socket = place[0].inputs.get(name)
            if socket is not None and hasattr(socket, "default_value"):
                return np.atleast_1d(np.array(socket.default_value, np.float64))[: len(channel.value)]
    return np.array(channel.value)


def _output(material: bpy.types.Material) -> Any:
    if material.node_tree is None:
        return None
    outputs = [node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]
    return next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)


def _shader(material: bpy.types.Material) -> Place | None:
    output = _output(material)
    if output is None:
        return None
    found = list(_upstream(output.inputs["Surface"], (), set()))
    order = {kind: number for number, kind in enumerate(_SHADERS)}
    known = [place for place in found if place[0].type in order]
    return min(known, key=lambda place: order[place[0].type], default=None)


def _upstream(socket: Any, groups: tuple[Any, ...], seen: set[int]) -> Iterator[Place]:
    """Yield all nodes that a socket hangs on, the nearest first, and the groups that they are in."""
    waiting = [(socket, groups)]
    while waiting:
        step = _behind(*waiting.pop(0))
        if step is None:
            continue
        from_socket, inside = step
        node = from_socket.node
        key = hash((node.as_pointer(), tuple(group.as_pointer() for group in inside)))
        if key in seen:
            continue
        seen.add(key)
        yield node, inside
        waiting += [(x, inside) for x in node.inputs]


def _behind(socket: Any, groups: tuple[Any, ...]) -> tuple[Any, tuple[Any, ...]] | None:
    """Return the output that an input hangs on, in and out of groups and past reroutes."""
    for _ in range(1000):
        if not socket.is_linked:
            return None
        link = socket.links[0]
        socket = link.from_socket
        node = link.from_node
        if node.mute and node.type != "GROUP" and node.inputs:
            socket = next((x for x in node.inputs if x.is_linked), node.inputs[0])
        elif node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree is not None:
            ends = [x for x in node.node_tree.nodes if x.type == "GROUP_OUTPUT" and x.is_active_output]
            inner = next((x for end in ends for x in end.inputs if x.identifier == socket.identifier), None)
            if inner is None:
                return None
            socket, groups = inner, (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            outer = next((x for x in groups[-1].inputs if x.identifier == socket.identifier), None)
            if outer is None:
                return None
            socket, groups = outer, groups[:-1]
        else:
            return socket, groups
    return None


def _traced(socket: Any, groups: tuple[Any, ...], channel: Channel) -> Found | None:
    """Return what a socket shows, looked for along its links."""
    step = _behind(socket, groups)
    if step is None:
        return None
    output, groups = step
    node = output.node
    if node.type == "TEX_IMAGE":
        return None if node.image is None else _image(node, output, groups)
    if node.type in ("VERTEX_COLOR", "ATTRIBUTE"):
        name = node.layer_name if node.type == "VERTEX_COLOR" else node.attribute_name
        part = "A" if output.name == "Alpha" else "RGB"
        return Found(None, name, part, "", np.eye(2, 3), EXTEND)
    if node.type == "BUMP":
        if channel.identifier == "normal":
            return _traced(node.inputs["Normal"], groups, channel)
        return _with(_traced(node.inputs["Height"], groups, channel), node, ("Strength", "Distance"))
    if node.type == "DISPLACEMENT":
        return _with(_traced(node.inputs["Height"], groups, channel), node, ("Midlevel", "Scale"))
    if node.type == "NORMAL_MAP":
        if channel.identifier != "normal":
            return None
        found = _with(_traced(node.inputs["Color"], groups, channel), node, ("Strength",))
        if found is not None and node.space != "TANGENT":
            return replace(found, passed=(*found.passed, node.name))
        return found
    if channel.identifier in ("normal", "height") and socket.name in ("Normal", "Displacement"):
        return None
    if node.type in ("SEPARATE_COLOR", "SEPRGB"):
        found = _traced(node.inputs[0], groups, channel)
        return None if found is None else replace(found, part=output.name[0])
    for entry in sorted(node.inputs, key=lambda x: x.type != "RGBA"):
        found = _traced(entry, groups, channel) if entry.enabled else None
        if found is not None:
            return replace(found, passed=(*found.passed, node.label or node.name))
    return None


def _with(found: Found | None, node: Any, names: tuple[str, ...]) -> Found | None:
    if found is None:
        return None
    return replace(found, settings=tuple((name, float(node.inputs[name].default_value)) for name in names))


def _image(node: Any, output: Any, groups: tuple[Any, ...]) -> Found:
    part = "A" if output.name == "Alpha" else "RGB"
    uv_map, matrix, passed = "", np.eye(2, 3), ()
    step = _behind(node.inputs["Vector"], groups)
    while step is not None:
        origin, groups = step
        other = origin.node
        if other.type == "MAPPING":
            matrix = _joined(matrix, _mapping(other))
            step = _behind(other.inputs["Vector"], groups)
            continue
        if other.type == "UVMAP":
            uv_map = other.uv_map
        elif not (other.type == "TEX_COORD" and origin.name == "UV"):
            passed = (other.label or other.name,)
        break
    if node.projection != "FLAT":
        passed = (*passed, node.label or node.name)
    return Found(node.image, None, part, uv_map, matrix, _WRAPS.get(node.extension, REPEAT), passed=passed)


def _mapping(node: Any) -> Floats:
    """Return what a Mapping node does to a plane, (2, 3)."""

    def given(name: str, default: float) -> Floats:
        socket = node.inputs.get(name)
        return np.full(3, default) if socket is None else np.array(socket.default_value, np.float64)

    angle, scale = given("Rotation", 0.0)[2], given("Scale", 1.0)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    place = given("Location", 0.0)[:2]
    if node.vector_type == "TEXTURE":  # the inverse
        linear = np.diag(1 / np.where(scale[:2] == 0, 1, scale[:2])) @ turn.T
        return np.column_stack([linear, -linear @ place])
    return np.column_stack([turn @ np.diag(scale[:2]), place if node.vector_type == "POINT" else np.zeros(2)])


def _joined(outer: Floats, inner: Floats) -> Floats:
    """Return the map of the plane, (2, 3), that is one after another."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])
