"""Names of masks that a field offers while one types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..attributes import mask_names


def nameable(role: str) -> Callable[[Any, bpy.types.Context, str], list[str]]:
    """Return what suggests names for a mask of the scene's source or target."""

    def suggest(_owner: Any, context: bpy.types.Context, _typed: str) -> list[str]:
        obj = getattr(context.scene.mobius, role)
        return [] if obj is None or obj.type != "MESH" else mask_names(obj)

    return suggest
