"""Pictures that were made, put into Blender: images, and a material that shows them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from ..attributes.access import MAX_UV_MAPS, AttributeAccess
from ..mesh_data import Refusal, foreach
from .images import new_image
from .layouts import rendered_uv
from .made import DATA, Made, Textures
from .marks import PROPERTY
from .nodes import shader_of

MASK = "Unmatched"

_UV = AttributeAccess("FLOAT2", "CORNER", "vector", 2)
_COLOR = AttributeAccess("FLOAT_COLOR", "CORNER", "color", 4)


@contextmanager
def made_or_removed() -> Iterator[list[Any]]:
    """Lend a list for images and materials that are made; they go again if the body fails, else what they replace."""
    made: list[Any] = []
    try:
        yield made
    except BaseException:
        for block in reversed(made):
            (bpy.data.materials if isinstance(block, bpy.types.Material) else bpy.data.images).remove(block)
        raise
    if made:
        _remove_unused(made)


def write_textures(obj: bpy.types.Object, found: Textures, made: list[Any], uv_map: str | None = None) -> None:
    """Give an object pictures in a new material, packed; what an earlier transfer made gives way.

    Parameters
    ----------
    obj : bpy.types.Object
    found : Textures
    made : list
        Gets what was made; see `made_or_removed`. The mesh is for the caller to put back.
    uv_map : str, optional
        A UV map that has been written already and is the layout.

    Raises
    ------
    Refusal
        The mesh has no room for the UV map.
    """
    for label, color in found.colors.items():
        _COLOR.write(obj, _COLOR.place(obj, label, frozenset()), color, np.ones(len(color), bool))
    if found.colors:
        return
    name = uv_map or _layout(obj, found)
    images = {}
    for one in found.made:
        images[one.channel.identifier] = _image(obj, one.channel.label, one.tiles, one.space, made)
    mask = None if found.mask is None else _image(obj, MASK, found.mask, DATA, made)
    if images:
        material = _material(obj, found, images, name, made)
        if mask is not None:  # nothing reads it, but it goes where the material goes
            node = material.node_tree.nodes.new("ShaderNodeTexImage")
            node.image, node.label, node.location = mask, MASK, (-700, 600)
        _assign(obj, material, found.polygons)


def has_pictures(obj: bpy.types.Object) -> bool:
    """Return whether an object shows pictures that a transfer has made."""
    return any(slot.material is not None and PROPERTY in slot.material for slot in obj.material_slots)


def _layout(obj: bpy.types.Object, found: Textures) -> str:
    layout = found.layout
    if layout.new is None:
        return layout.name
    if len(obj.data.uv_layers) >= MAX_UV_MAPS:
        raise Refusal(f"'{obj.name}' has {MAX_UV_MAPS} UV maps, and Blender allows no more: delete one")
    name = _UV.place(obj, layout.name, frozenset(), number=True)
    own = bool(rendered_uv(obj.data))
    _UV.write(obj, name, layout.new, np.ones(len(layout.new), bool))
    if not own:
        obj.data.uv_layers[name].active_render = True
    return name


def _image(obj: bpy.types.Object, label: str, tiles: Any, space: str, made: list[Any]) -> Any:
    image = new_image(f"{obj.name} {label}", tiles, space)
    made.append(image)
    image[PROPERTY] = obj.name
    return image


def _material(obj: bpy.types.Object, found: Textures, images: dict[str, Any], uv_map: str, made: list[Any]) -> Any:
    """Return a new material that shows pictures by the channels that they are for."""
    material: Any = bpy.data.materials.new(f"{obj.name} Textures")
    made.append(material)
    material[PROPERTY] = obj.name
    if material.node_tree is None:  # from Blender 5 on every material has one
        material.use_nodes = True
    tree: Any = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    output.location = 300, 0
    _copy_values(bpy.data.materials.get(found.material), shader)
    place = tree.nodes.new("ShaderNodeUVMap")
    place.uv_map, place.location = uv_map, (-1000, 0)
    by_channel = {one.channel.identifier: one for one in found.made}
    read = {}
    for number, (channel, image) in enumerate(images.items()):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.label, node.location = image, by_channel[channel].channel.label, (-700, 300 - 300 * number)
        tree.links.new(place.outputs["UV"], node.inputs["Vector"])
        read[channel] = node
    sockets = {"base_color": "Base Color", "roughness": "Roughness", "metallic": "Metallic", "alpha": "Alpha"}
    for channel, socket in (sockets | {"emission": "Emission Color"}).items():
        if channel in read:
            tree.links.new(read[channel].outputs["Color"], shader.inputs[socket])
    if found.alpha and "base_color" in read:
        tree.links.new(read["base_color"].outputs["Alpha"], shader.inputs["Alpha"])
    if "emission" in read and not shader.inputs["Emission Strength"].default_value:
        shader.inputs["Emission Strength"].default_value = 1.0
    normal = None
    if "normal" in read:
        normal = tree.nodes.new("ShaderNodeNormalMap")
        normal.uv_map, normal.location = uv_map, (-350, -200)
        _set(normal, by_channel["normal"])
        tree.links.new(read["normal"].outputs["Color"], normal.inputs["Color"])
        tree.links.new(normal.outputs["Normal"], shader.inputs["Normal"])
    if "height" in read:
        _height(tree, read["height"], by_channel["height"], normal, shader, output)
    return material


def _height(tree: Any, image: Any, made: Made, normal: Any, shader: Any, output: Any) -> None:
    if any(name == "Scale" for name, _ in made.settings):
        node = tree.nodes.new("ShaderNodeDisplacement")
        tree.links.new(node.outputs["Displacement"], output.inputs["Displacement"])
    else:
        node = tree.nodes.new("ShaderNodeBump")
        if normal is not None:
            tree.links.new(normal.outputs["Normal"], node.inputs["Normal"])
        tree.links.new(node.outputs["Normal"], shader.inputs["Normal"])
    node.location = -150, -400
    _set(node, made)
    tree.links.new(image.outputs["Color"], node.inputs["Height"])


def _set(node: Any, made: Made) -> None:
    for name, value in made.settings:
        node.inputs[name].default_value = value


def _copy_values(source: Any, shader: Any) -> None:
    """Take over from a material's shader what it says without a link."""
    origin = None if source is None else shader_of(source)
    if origin is None or origin.type != shader.type:
        return
    for given in origin.inputs:
        own = next((x for x in shader.inputs if x.identifier == given.identifier), None)
        if own is not None and not given.is_linked and hasattr(own, "default_value"):
            own.default_value = given.default_value


def _assign(obj: bpy.types.Object, material: Any, polygons: Any) -> None:
    """Show a material on some polygons, (p,), in the place of one that an earlier transfer made."""
    materials = obj.data.materials
    earlier = [k for k, slot in enumerate(obj.material_slots) if slot.material and PROPERTY in slot.material]
    if earlier:
        number = earlier[0]
        obj.material_slots[number].material = material
    else:
        if not len(materials) and not polygons.all():
            materials.append(None)  # the others stay without one
        materials.append(material)
        number = len(materials) - 1
    index = foreach(obj.data.polygons, "material_index", 1, np.int32)
    index[polygons] = number
    obj.data.polygons.foreach_set("material_index", index)
    obj.data.update()


def _remove_unused(made: list[Any]) -> None:
    """Remove what earlier transfers made for the same objects and nothing uses any more."""
    names = {block[PROPERTY] for block in made}
    for blocks in (bpy.data.materials, bpy.data.images):
        for block in [x for x in blocks if x.get(PROPERTY) in names and x not in made]:
            if block.users == int(block.use_fake_user):
                blocks.remove(block)
