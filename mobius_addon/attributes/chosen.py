"""Which of an object's layers a transfer carries: all, the active one of a kind, by name, or of deforming bones."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..mesh_data import Refusal
from .active import persons_own
from .settings import TransferSettings


def chosen_layers(
    kind: str, source: bpy.types.Object, target: bpy.types.Object, settings: TransferSettings
) -> Callable[[str], bool]:
    """Return which names of a kind of layer are chosen.

    Raises
    ------
    Refusal
        Deforming bones are asked for and neither object has an armature.
    """
    if kind == "vertex-groups" and settings.deform_only:
        bones = deforming_bones(source) | deforming_bones(target)
        if not bones:
            raise Refusal(f"Neither '{source.name}' nor '{target.name}' has an armature with deforming bones")
    else:
        bones = None
    active = active_name(kind, source) if settings.layers == "active" else None

    def chosen(name: str) -> bool:
        if bones is not None and name not in bones:
            return False
        if settings.layers == "named":
            return settings.names_layer(name)
        return settings.layers == "all" or name == active

    return chosen


def active_name(kind: str, obj: bpy.types.Object) -> str | None:
    """Return the name of an object's active layer of a kind, if it has one; see `persons_own`."""
    own = persons_own(obj)
    key = obj.active_shape_key
    return {
        "vertex-groups": own.group,
        "shape-keys": key.name if key is not None else "",
        "uv": own.uv,
        "colors": own.color,
        "attributes": own.attribute,
    }.get(kind) or None


def deforming_bones(obj: bpy.types.Object) -> frozenset[str]:
    """Return the names of the deforming bones of the armatures that move an object, by modifier or as its parent."""
    armatures = [modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE"]
    if obj.parent is not None and obj.parent.type == "ARMATURE":
        armatures.append(obj.parent)
    return frozenset(bone.name for x in armatures if x is not None for bone in x.data.bones if bone.use_deform)
