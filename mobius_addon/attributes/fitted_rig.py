"""The armature that moves a mesh copied, and fitted to another mesh by joints that were carried there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..mesh_data import Refusal
from .rig import Rig, armature_of, world_matrix


def write_rig(obj: bpy.types.Object, rig: Rig) -> None:
    """Give an object a copy of the source's armature that fits it, as modifier and parent as the source has it.

    Raises
    ------
    Refusal
        The source or its armature has gone since.
    """
    source = _source_of(rig)
    armature = armature_of(source) if source is not None else None
    if source is None or armature is None or [bone.name for bone in armature.data.bones] != [x for x, _ in rig.names]:
        raise Refusal(f"'{rig.source}' is no longer moved by the armature that was read: transfer again")
    copy = armature.copy()
    copy.data = armature.data.copy()
    try:
        _make(obj, source, armature, copy, rig)
    except BaseException:
        for modifier in [x for x in obj.modifiers if x.type == "ARMATURE" and x.object == copy]:
            obj.modifiers.remove(modifier)
        bpy.data.armatures.remove(copy.data)  # with the object
        raise


def share_rig(obj: bpy.types.Object, others: Sequence[bpy.types.Object], rig: Rig) -> None:
    """Let the armature that `write_rig` has given an object move others too, which belong to it and have none."""
    source = _source_of(rig)
    armature, copy = (armature_of(x) if x is not None else None for x in (source, obj))
    if source is None or armature is None or copy is None:
        return
    for other in others:
        if armature_of(other) is None:
            _attach(other, source, armature, copy, dict(rig.names))


def _source_of(rig: Rig) -> bpy.types.Object | None:
    return next((x for x in bpy.data.objects if x.session_uid == rig.uid), None)


def _make(
    obj: bpy.types.Object, source: bpy.types.Object, armature: bpy.types.Object, copy: bpy.types.Object, rig: Rig
) -> None:
    copy.name = copy.data.name = f"{obj.name} {armature.name}"
    copy.parent = None
    for collection in obj.users_collection:
        collection.objects.link(copy)
    place = world_matrix(obj)
    copy.matrix_world = place @ Matrix(rig.matrix.tolist())
    old = np.array([bone.length for bone in armature.data.bones])
    _fit(copy, rig)
    _rename(copy, rig)
    _look_at_itself(copy, armature)
    names = dict(rig.names)
    for bone, before in zip(armature.data.bones, old, strict=True):
        fitted = copy.pose.bones[names[bone.name]]
        for constraint in fitted.constraints:
            if constraint.type == "STRETCH_TO" and constraint.rest_length > 0 and before > 0:
                constraint.rest_length *= fitted.bone.length / before
    _attach(obj, source, armature, copy, names)


def _fit(copy: bpy.types.Object, rig: Rig) -> None:
    """Move the bones of an armature; only Edit Mode lets them be moved."""
    scene = bpy.data.scenes.new("Mobius Rig")
    try:
        scene.collection.objects.link(copy)
        view = scene.view_layers[0]
        hidden, copy.hide_viewport = copy.hide_viewport, False
        with bpy.context.temp_override(
            scene=scene, view_layer=view, object=copy, active_object=copy, selected_objects=[copy]
        ):
            view.objects.active = copy
            copy.select_set(True, view_layer=view)
            bpy.ops.object.mode_set(mode="EDIT")
            bones = copy.data.edit_bones
            # ends that hang together would move each other
            joined = [bone.name for bone in bones if bone.use_connect]
            for bone in bones:
                bone.use_connect = False
            for (name, _), head, tail, upright in zip(rig.names, rig.heads, rig.tails, rig.upright, strict=True):
                bone = bones[name]
                bone.head, bone.tail = Vector(head), Vector(tail)
                bone.align_roll(Vector(upright))
            for name in joined:
                bones[name].use_connect = True
            bpy.ops.object.mode_set(mode="OBJECT")
        copy.hide_viewport = hidden
    finally:
        bpy.data.scenes.remove(scene)


def _rename(copy: bpy.types.Object, rig: Rig) -> None:
    """Give bones their names on the target: of a mirrored rig left and right change places."""
    changed = [(old, new) for old, new in rig.names if old != new]
    if not changed:
        return
    data = copy.animation_data
    if data is not None and data.action is not None:  # which is renamed with them, and the source's too
        data.action = data.action.copy()
    bones = copy.data.bones
    passing = [(bones[old], new) for old, new in changed]
    for number, (bone, _) in enumerate(passing):
        bone.name = f"mobius passing {number}"
    for bone, new in passing:
        bone.name = new


def _look_at_itself(copy: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Let constraints and drivers that point at the armature point at its copy."""
    constraints = [x for bone in copy.pose.bones for x in bone.constraints] + list(copy.constraints)
    for constraint in constraints:
        targets = getattr(constraint, "targets", ())
        for pointer in (constraint, *targets):
            for name in ("target", "pole_target"):
                if getattr(pointer, name, None) == armature:
                    setattr(pointer, name, copy)
    exchanged = {armature: copy, armature.data: copy.data}
    for owner in (copy, copy.data):
        for curve in owner.animation_data.drivers if owner.animation_data is not None else ():
            for variable in curve.driver.variables:
                for end in variable.targets:
                    if end.id in exchanged:
                        end.id = exchanged[end.id]


def _attach(
    obj: bpy.types.Object,
    source: bpy.types.Object,
    armature: bpy.types.Object,
    copy: bpy.types.Object,
    names: dict[str, str],
) -> None:
    """Give an object the modifiers and the parent by which an armature moves the source."""
    position = 0
    for modifier in source.modifiers:
        if modifier.type == "ARMATURE" and modifier.object == armature:
            own: Any = obj.modifiers.new(modifier.name, "ARMATURE")
            for prop in modifier.bl_rna.properties:
                if not prop.is_readonly and prop.identifier not in ("name", "object", "execution_time"):
                    setattr(own, prop.identifier, getattr(modifier, prop.identifier))
            own.object = copy
            # bones move the mesh before others subdivide or thicken it
            obj.modifiers.move(len(obj.modifiers) - 1, position)
            position += 1
    if source.parent == armature and obj.parent is None:
        place = world_matrix(obj)
        obj.parent, obj.parent_type = copy, source.parent_type
        if source.parent_type == "BONE":
            obj.parent_bone = names.get(source.parent_bone, source.parent_bone)
        else:
            obj.matrix_parent_inverse = world_matrix(copy).inverted_safe()
        obj.matrix_world = place
