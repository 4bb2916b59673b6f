"""What the textures of a transfer will look like, shown on a copy of the target before any is made."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import bpy

from ..mesh_data import Refusal
from .writing import PROPERTY, made_or_removed, write_textures

if TYPE_CHECKING:
    from ..attributes import Transfer, TransferSettings

SIZE = 1024
"""Side of the pictures of a preview at most, in texels: as many as half of a large window shows."""

PREVIEW_OF = "mobius_preview_of"
"""Custom property of the mesh of a copy that shows a preview: the name of the target's."""


def preview_settings(settings: TransferSettings) -> TransferSettings | None:
    """Return the settings that carry a preview; None: no pictures are to be transferred."""
    chosen = settings.textures
    if "textures" not in settings.kinds or chosen.result != "pictures":
        return None
    size = min(chosen.size or SIZE, SIZE)
    return replace(settings, kinds=("textures",), textures=replace(chosen, size=size, mask=False))


def show_preview(copy: bpy.types.Object, plan: Transfer) -> bool:
    """Give a copy of the target a mesh of its own with the pictures of a transfer; return whether there are any.

    Raises
    ------
    Refusal
        The mesh has no room for the UV map.
    """
    if plan.textures is None or not plan.textures.made:
        return False
    shared = copy.data
    copy.data = shared.copy()
    copy.data[PREVIEW_OF] = shared.name
    try:
        with made_or_removed() as made:
            write_textures(copy, plan.textures, made)
    except Refusal:
        own, copy.data = copy.data, shared
        bpy.data.meshes.remove(own)
        raise
    return True


def is_preview_of(mesh: bpy.types.Mesh, name: str) -> bool:
    """Return whether a mesh is that of a preview for the target's mesh of this name."""
    return mesh.get(PREVIEW_OF) == name


def leave_out_preview(mesh: bpy.types.Mesh) -> None:
    """Have Blender leave out what was made for a preview when it saves, but for what a person has used elsewhere."""
    if PREVIEW_OF not in mesh:
        return
    materials, images = _made(mesh)
    mesh.is_runtime_data = mesh.users == 1
    slots = list(mesh.materials)
    for material in materials:
        material.is_runtime_data = mesh.is_runtime_data and material.users <= slots.count(material)
    alone = all(material.is_runtime_data for material in materials)
    for image in set(images):
        image.is_runtime_data = alone and image.users <= images.count(image)


def _made(mesh: bpy.types.Mesh) -> tuple[list[Any], list[Any]]:
    """Return the materials that were made for a preview, and the picture of each of their nodes."""
    materials = list({x for x in mesh.materials if x is not None and PROPERTY in x})
    nodes = [x for material in materials for x in material.node_tree.nodes if x.type == "TEX_IMAGE"]
    return materials, [x.image for x in nodes if x.image is not None and PROPERTY in x.image]


def remove_preview(mesh: bpy.types.Mesh) -> None:
    """Remove the mesh of a copy that is gone, if it was a preview's own, with its material and pictures."""
    if PREVIEW_OF not in mesh or mesh.users:
        return
    materials, images = _made(mesh)
    bpy.data.meshes.remove(mesh)
    for material in materials:
        if not material.users:
            bpy.data.materials.remove(material)
    for image in set(images):
        if not image.users:
            bpy.data.images.remove(image)
