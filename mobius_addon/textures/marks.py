"""By what is known that a material, picture or mesh was made by a transfer or for a preview, and how it goes again."""

from __future__ import annotations

from typing import Any

import bpy

PROPERTY = "mobius_textures"
"""Custom property of materials and images that a transfer has made."""

PREVIEW_OF = "mobius_preview_of"
"""Custom property of the mesh of a copy that shows a preview: the name of the target's."""


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
