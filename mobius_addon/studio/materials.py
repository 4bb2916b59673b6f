"""What surfaces in pictures wear: nodes of materials, and what links them."""

from __future__ import annotations

from typing import Any

import bpy

INK = (0.02, 0.02, 0.025)
CLAY = (0.42, 0.43, 0.45)


def flat_material(color_attribute: str | None) -> bpy.types.Material:
    """Return a material that needs no light: a color attribute, or ink where there is none."""
    material = bpy.data.materials.new("Studio flat")
    nodes, links = fresh_tree(material)
    if color_attribute:
        color = nodes.new("ShaderNodeVertexColor")
        color.layer_name = color_attribute
    else:
        color = nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = (*INK, 1.0)
    glow(nodes, links, color.outputs["Color"])
    return material


def fresh_tree(owner: bpy.types.Material | bpy.types.World) -> tuple[bpy.types.Nodes, bpy.types.NodeLinks]:
    """Return the emptied nodes of a new material or world."""
    if owner.node_tree is None:  # from Blender 5.0 on they are born with one
        owner.use_nodes = True
    tree: Any = owner.node_tree
    tree.nodes.clear()
    return tree.nodes, tree.links


def darken(
    nodes: bpy.types.Nodes,
    links: bpy.types.NodeLinks,
    color: bpy.types.NodeSocket,
    where: bpy.types.NodeSocket,
    brightness: float,
) -> bpy.types.NodeSocket:
    """Multiply `color` by `brightness` where the mask `where` is 1."""
    factor = nodes.new("ShaderNodeMapRange")
    factor.inputs["To Min"].default_value = 1.0
    factor.inputs["To Max"].default_value = brightness
    links.new(where, factor.inputs["Value"])
    product = nodes.new("ShaderNodeVectorMath")
    product.operation = "SCALE"
    links.new(color, product.inputs[0])
    links.new(factor.outputs[0], product.inputs["Scale"])
    return product.outputs[0]


def cover(nodes: bpy.types.Nodes, links: bpy.types.NodeLinks, color: bpy.types.NodeSocket) -> None:
    """Make a half-glossy surface of `color`."""
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Roughness"].default_value = 0.55
    links.new(color, surface.inputs["Base Color"])
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def glow(nodes: bpy.types.Nodes, links: bpy.types.NodeLinks, color: bpy.types.NodeSocket) -> None:
    """Make a surface show `color` as it is, without light."""
    emission = nodes.new("ShaderNodeEmission")
    links.new(color, emission.inputs["Color"])
    links.new(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
