"""The armature that moves a mesh: copied, and fitted to another mesh with its joints where they belong there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...solver.carry.joints import carried_joints
from ...solver.surface.mesh import Floats, Integers
from ..mesh_data import Refusal, is_mirrored
from .carrier import Carrier
from .vertex_groups import read_weights

_SAME = 1e-5
"""Ends of bones nearer than this, of the armature's size, are one joint."""


def armature_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Return the armature that moves an object, by its first modifier that has one or as its parent."""
    for modifier in obj.modifiers:
        if modifier.type == "ARMATURE" and modifier.object is not None:
            return modifier.object
    parent = obj.parent
    return parent if parent is not None and parent.type == "ARMATURE" else None


@dataclass(frozen=True, eq=False)
class Rig:
    """An armature that is fitted to the target, not yet made.

    Attributes
    ----------
    source : str
        Name of the mesh object.
    uid : int
        That object's number in this session.
    matrix : (4, 4) float64
        Where the new armature is in the space of the target.
    heads, tails, upright : (b, 3) float64
        Of each bone in the armature's own space; `upright` is the direction of its z axis.
    names : tuple of (str, str)
        Of each bone on the source and on the target.
    """

    source: str
    uid: int
    matrix: Floats
    heads: Floats
    tails: Floats
    upright: Floats
    names: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class RigReading:
    """The source's armature as arrays, in the space of its `Surface`: `carry` may run in a thread of its own."""

    carrier: Carrier
    names: tuple[str, ...]
    flipped: tuple[str, ...]
    source: tuple[str, int]
    matrix: Floats
    joints: Floats
    reach: Floats
    influence: Floats
    ends: Integers
    upright: Floats
    target_mirrored: bool

    def carry(self) -> Rig:
        """Carry every joint.

        The armature as a whole goes by the similarity that is best for the whole surface, so that its bones keep their
        lengths, and motions their size, as far as the two surfaces are of one shape.
        """
        mirrors = self.carrier.mirrors
        source, target = self.carrier.source.rest, self.carrier.target.rest
        middle, size = source.vertices.mean(axis=0), float(np.linalg.norm(np.ptp(source.vertices, axis=0)))
        # far beyond the surface all of it counts alike
        joints = np.vstack([self.joints, middle])
        reach = np.append(self.reach, 1e3 * size)
        influence = np.column_stack([self.influence, np.ones(len(source.vertices))])
        found = carried_joints(self.carrier.correspondence, source, target, joints, reach, influence, mirrored=mirrors)
        flip = np.diag([-1.0 if self.target_mirrored else 1.0, 1.0, 1.0])
        places, turn = found(joints) @ flip, flip @ found.turn
        whole = np.eye(4)
        whole[:3, :3] = found.scale[-1] * turn[-1]
        whole[:3, 3] = places[-1] - whole[:3, :3] @ middle
        matrix = whole @ self.matrix
        if np.linalg.det(matrix[:3, :3]) < 0:
            matrix = matrix @ np.diag([-1.0, 1.0, 1.0, 1.0])
        back = np.linalg.inv(matrix)
        own = places[:-1] @ back[:3, :3].T + back[:3, 3]
        upright = np.einsum("ij,bjk,bk->bi", back[:3, :3], turn[self.ends[:, 0]], self.upright)
        names = self.flipped if mirrors else self.names
        return Rig(
            *self.source,
            matrix,
            own[self.ends[:, 0]],
            own[self.ends[:, 1]],
            upright,
            tuple(zip(self.names, names, strict=True)),
        )


def read_rig(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier
) -> tuple[RigReading | None, list[str]]:
    """Read the armature that moves the source, and sentences about why not.

    Raises
    ------
    Refusal
        The source has none.
    """
    armature = armature_of(source)
    if armature is None:
        raise Refusal(f"'{source.name}' has no armature: there is no rig to carry")
    if (own := armature_of(target)) is not None:
        return None, [
            f"'{target.name}' is moved by '{own.name}', which stays: the rig of '{source.name}' is not carried"
        ]
    bones = armature.data.bones
    if not bones:
        return None, [f"'{armature.name}' has no bones"]
    own_space = np.array(world_matrix(source).inverted_safe() @ world_matrix(armature), dtype=np.float64)
    flip = np.diag([-1.0 if is_mirrored(source) else 1.0, 1.0, 1.0, 1.0])
    matrix: Floats = np.matmul(flip, own_space)
    linear = matrix[:3, :3]
    ends = np.array([[bone.head_local, bone.tail_local] for bone in bones], dtype=np.float64).reshape(-1, 3)
    joints, number = _joints(ends)
    groups = {group.name for group in source.vertex_groups}
    moving = [bone.name for bone in bones if bone.name in groups and bone.use_deform]
    column = {name: k for k, name in enumerate(moving)}
    weights = np.clip(np.nan_to_num(read_weights(source, moving)), 0, 1)
    influence = np.zeros((len(weights), len(joints)))
    length = np.full(len(joints), np.inf)
    for bone, pair in zip(bones, number, strict=True):
        for joint in set(pair.tolist()):
            length[joint] = min(length[joint], bone.length)
            if bone.name in column:
                influence[:, joint] = np.minimum(influence[:, joint] + weights[:, column[bone.name]], 1)
    scale = abs(np.linalg.det(linear)) ** (1 / 3)
    # a normal, so that the z axis stays at right angles to a bone in a stretched armature too
    upright = np.array([bone.matrix_local.col[2][:3] for bone in bones]) @ np.linalg.inv(linear)
    reading = RigReading(
        carrier,
        tuple(bone.name for bone in bones),
        tuple(bpy.utils.flip_name(bone.name) for bone in bones),
        (source.name, source.session_uid),
        matrix,
        joints @ linear.T + matrix[:3, 3],
        scale * length,
        influence,
        number,
        upright,
        is_mirrored(target),
    )
    return reading, []


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


def world_matrix(obj: bpy.types.Object) -> Matrix:
    """Return where an object is, whether or not Blender has evaluated it, as of one that no scene shows."""
    if obj.users_scene or obj.parent is None:
        return obj.matrix_world.copy() if obj.users_scene else obj.matrix_basis.copy()
    return world_matrix(obj.parent) @ obj.matrix_parent_inverse @ obj.matrix_basis


def _joints(ends: Floats) -> tuple[Floats, Integers]:
    """Return the different places among ends of bones, (2 b, 3), and which each bone has, (b, 2)."""
    size = float(np.linalg.norm(np.ptp(ends, axis=0))) or 1.0
    _, first, number = np.unique(np.round(ends / (_SAME * size)), axis=0, return_index=True, return_inverse=True)
    return ends[first], number.reshape(-1, 2)


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
