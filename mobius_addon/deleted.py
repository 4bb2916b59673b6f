"""Source and target of the panel are let go once they are deleted, so that Blender can purge them.

What a scene points at counts as used: a mesh that is deleted in the viewport would stay in the file for ever.
"""

from __future__ import annotations

import bpy

from .handlers import unwatch, watch
from .usable import is_deleted


def let_go(scene: bpy.types.Scene) -> None:
    """Forget a chosen object that is in no scene and no collection any more."""
    settings = scene.mobius
    for role in ("source", "target"):
        obj = getattr(settings, role)
        # by name first, which is fast
        if obj is not None and scene.objects.get(obj.name) != obj and is_deleted(obj):
            settings.property_unset(role)


def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if depsgraph.id_type_updated("SCENE") or depsgraph.id_type_updated("COLLECTION"):
        _on_save()


def _on_save(*_: object) -> None:
    for scene in bpy.data.scenes:
        if scene.is_editable:
            let_go(scene)


_HANDLERS = (("depsgraph_update_post", _on_update), ("save_pre", _on_save))


def register() -> None:
    """Watch for objects that are deleted."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Stop watching."""
    unwatch(*_HANDLERS)
