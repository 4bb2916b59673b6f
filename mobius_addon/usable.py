"""Whether an operator may work on an object, and if not, the sentence that says why and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from . import comparison, stored_alignment

MODES = ("OBJECT", "POSE")
"""Of a window, in which meshes are written: other modes keep undo steps of their own, which would lack ours."""

_RENDERS = ("RENDER", "OBJECT_BAKE")


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
    if obj.type != "MESH" and obj.instance_type == "COLLECTION":
        return instance(obj)
    if obj.type != "MESH":
        text = rpt_("'{}' is no mesh: convert it (Object > Convert > Mesh) or choose another {}")
        return text.format(obj.name, called)
    if comparison.is_copy(obj):
        return rpt_("'{}' is a copy of Side by Side: choose the object that it shows").format(obj.name)
    if not is_in_scene(obj, scene):
        if (shown := _instance_with(obj, scene)) is not None:
            return instance(shown)
        return rpt_("'{}' is not in this scene: choose another {}").format(obj.name, called)
    return _why_not_read(obj) or (why_not_written(obj) if writes else None)


def instance(empty: bpy.types.Object) -> str:
    """Return the sentence for an empty that shows a collection, whose meshes nobody can work on."""
    text = rpt_("'{}' is a collection instance: select it and make its meshes real (Object > Apply > {})")
    return text.format(empty.name, iface_("Make Instances Real", "Operator"))


def _instance_with(obj: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the object of a scene that shows another as part of a collection, or None; one in one counts too."""

    def shows(empty: bpy.types.Object, known: frozenset[Any]) -> bool:
        collection = empty.instance_collection
        if empty.instance_type != "COLLECTION" or collection is None or collection in known:
            return False
        return any(other == obj or shows(other, known | {collection}) for other in collection.all_objects)

    return next((empty for empty in scene.objects if shows(empty, frozenset())), None)


def _why_not_read(obj: bpy.types.Object) -> str | None:
    """Return why the mesh of an object cannot be read, or None if it can."""
    if obj.mode != "OBJECT":
        return _in_mode(obj)
    if obj.data.is_editmode:
        text = rpt_("'{}' shares its mesh with an object in Edit Mode: switch to Object Mode first")
        return text.format(obj.name)
    return None


def _in_mode(obj: bpy.types.Object) -> str:
    mode = obj.mode.replace("_", " ").title()
    return rpt_("'{}' is in {} Mode: switch to Object Mode first").format(obj.name, mode)


def why_not_written(obj: bpy.types.Object) -> str | None:
    """Return why a mesh object of any scene cannot be changed, or None if it can."""
    if reason := _why_not_read(obj):
        return reason
    if is_read_only(obj):
        text = rpt_(
            "'{}' is linked from another file: make it local first "
            "(Object > Relations > Make Local > Selected Objects and Data)"
        )
        return text.format(obj.name)
    return None


def is_read_only(obj: bpy.types.Object) -> bool:
    """Return whether the mesh of an object is another file's: linked, or an override of one that is."""
    # of an overridden mesh Blender keeps no layer when the file is saved, though all can be written
    return not (obj.is_editable and obj.data.is_editable) or obj.data.override_library is not None


def written(source: bpy.types.Object, target: bpy.types.Object) -> list[bpy.types.Object]:
    """Return which meshes of a pair an alignment is written on: a source of another file is only read."""
    return [target] if is_read_only(source) else [source, target]


def is_in_scene(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Return whether an object is in a scene; one that was deleted while something still points to it is not."""
    # by name first, which is fast; a linked and a local object can have one name
    return scene.objects.get(obj.name) == obj or any(other == obj for other in scene.objects)


def is_deleted(obj: bpy.types.Object) -> bool:
    """Return whether an object is in no scene and no collection: deleted, and here only until the file is saved."""
    return not (obj.users_scene or obj.users_collection)


def by_uid(among: Iterable[Any], uid: int | None) -> Any:
    """Return the datablock with Blender's number of this session, which undo and renaming leave alone, or None."""
    return next((block for block in among if block.session_uid == uid), None)


def why_not_now(context: bpy.types.Context, objects: Sequence[bpy.types.Object | None]) -> str | None:
    """Return why nothing can be written on these meshes for the time being, or None if it can; None is no object."""
    if any(bpy.app.is_job_running(job) for job in _RENDERS):
        return rpt_("the render has to end")
    for obj in objects:
        if obj is not None and obj.type == "MESH" and (obj.mode != "OBJECT" or obj.data.is_editmode):
            return rpt_("'{}' has to be in Object Mode").format(obj.name)
    active = [window.view_layer.objects.active for window in context.window_manager.windows]
    if other := next((obj for obj in active if obj is not None and obj.mode not in MODES), None):
        return rpt_("'{}' has to be in Object Mode").format(other.name)
    return None


def why_not_mode(context: bpy.types.Context) -> str | None:
    """Return why no mesh can be written in the mode of the context, or None if it can."""
    return None if context.mode in MODES else rpt_("Switch to Object Mode first")


def why_not_object_mode(context: bpy.types.Context) -> str | None:
    """Return why what goes through Edit Mode or shows other objects cannot be done now, or None if it can."""
    return None if context.mode == "OBJECT" else rpt_("Switch to Object Mode first")


def why_not_alone(context: bpy.types.Context, obj: bpy.types.Object) -> str | None:
    """Return why an object cannot be edited without another one, or None if it can.

    Objects that are in Edit Mode without being active, as they can be in a view layer, are edited with the active one.
    """
    others = (other for other in context.view_layer.objects if other != obj and other.mode == "EDIT")
    if (other := next(others, None)) is None:
        return None
    return _in_mode(other)


def why_not_pair(context: bpy.types.Context, *, writes_source: bool, writes_target: bool = True) -> str | None:
    """Return why the chosen source and target cannot be used together, or None if they can."""
    settings, scene = context.scene.mobius, context.scene
    source, target = settings.source, settings.target
    reason = why_not(source, "source mesh", scene, writes=writes_source)
    reason = reason or why_not(target, "target mesh", scene, writes=writes_target) or why_not_two(source, target)
    return reason or (why_not_mode(context) if writes_source or writes_target else None)


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


def why_not_aligned(
    context: bpy.types.Context, *, writes_source: bool = False, writes_target: bool = True
) -> str | None:
    """Return why the alignment of the chosen source and target cannot be used, or None if it can.

    `writes_source` and `writes_target` tell which of them will be changed.
    """
    reason = why_not_pair(context, writes_source=writes_source, writes_target=writes_target)
    settings = context.scene.mobius
    if reason is None and not stored_alignment.exists(settings.target, settings.source):
        reason = stored_alignment.missing(settings.target, settings.source)
    return reason
