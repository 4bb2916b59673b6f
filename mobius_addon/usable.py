"""Whether an operator may work on an object, and if not, the sentence that says why and what to do."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import stored_alignment


def why_not(obj: bpy.types.Object | None, role: str, scene: bpy.types.Scene, *, writes: bool = True) -> str | None:
    """Return why an object cannot be used, or None if it can.

    Parameters
    ----------
    obj : bpy.types.Object or None
        What was chosen.
    role : str
        What it was chosen as: "source mesh", "target mesh", "mesh".
    scene : bpy.types.Scene
        The scene that it has to be in.
    writes : bool
        Whether its data will be changed.
    """
    called = rpt_(role)
    if obj is None:
        return rpt_("Choose a {} first").format(called)
    if obj.type != "MESH":
        text = rpt_("'{}' is no mesh: convert it (Object > Convert > Mesh) or choose another {}")
        return text.format(obj.name, called)
    if not is_in_scene(obj, scene):
        return rpt_("'{}' is not in this scene: choose another {}").format(obj.name, called)
    if obj.mode != "OBJECT":
        mode = obj.mode.replace("_", " ").title()
        return rpt_("'{}' is in {} Mode: switch to Object Mode first").format(obj.name, mode)
    if writes and not (obj.is_editable and obj.data.is_editable):
        text = rpt_("'{}' is linked from another file: make it local first (Object > Relations > Make Local)")
        return text.format(obj.name)
    return None


def is_in_scene(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Return whether an object is in a scene; one that was deleted while something still points to it is not."""
    # by name first, which is fast; a linked and a local object can have one name
    return scene.objects.get(obj.name) == obj or any(other == obj for other in scene.objects)


def why_not_pair(
    settings: bpy.types.PropertyGroup, scene: bpy.types.Scene, *, writes_source: bool, writes_target: bool = True
) -> str | None:
    """Return why the chosen source and target cannot be used together, or None if they can."""
    source, target = settings.source, settings.target
    reason = why_not(source, "source mesh", scene, writes=writes_source)
    return reason or why_not(target, "target mesh", scene, writes=writes_target) or why_not_two(source, target)


def why_not_two(source: bpy.types.Object, target: bpy.types.Object) -> str | None:
    """Return why two meshes are not two, or None if they are."""
    if source == target:
        return rpt_("'{}' is both source and target: choose two objects").format(source.name)
    if source.data == target.data:
        text = rpt_(
            "'{}' and '{}' share one mesh: make one single-user first "
            "(Object > Relations > Make Single User > Object & Data)"
        )
        return text.format(source.name, target.name)
    return None


def why_not_aligned(settings: bpy.types.PropertyGroup, scene: bpy.types.Scene, *, writes: bool = True) -> str | None:
    """Return why the alignment of the chosen source and target cannot be used, or None if it can.

    `writes` tells whether the target will be changed.
    """
    reason = why_not_pair(settings, scene, writes_source=False, writes_target=writes)
    if reason is None and not stored_alignment.exists(settings.target, settings.source):
        reason = stored_alignment.missing(settings.target, settings.source)
    return reason
