"""The armature that moves a mesh, read, and its joints carried to where they belong on another mesh."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

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
