"""What the textures of a transfer will look like, shown on a copy of the target before any is made."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy

from ..mesh_data import Refusal
from .marks import PREVIEW_OF
from .writing import made_or_removed, write_textures

if TYPE_CHECKING:
    from ..attributes import Transfer, TransferSettings

SIZE = 1024
"""Side of the pictures of a preview at most, in texels: as many as half of a large window shows."""


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
