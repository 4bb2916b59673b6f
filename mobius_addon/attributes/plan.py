"""A transfer that is computed: what is written on the target, all or nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import bpy

from ...solver.surface.mesh import Booleans
from ..textures.made import Textures
from ..textures.writing import made_or_removed, write_textures
from .carrier import Values
from .fitted_rig import write_rig
from .key_set import KeyPlan
from .record import remember, unedited
from .rig import Rig
from .table import KINDS, Row
from .unmatched import Unmatched
from .vertex_groups import keep_order


@dataclass(frozen=True, eq=False)
class Carried:
    """A layer on its way: computed for the target, not yet written."""

    row: Row
    source_name: str
    name: str
    values: Values
    covered: Booleans
    about: Any
    own: bool = False
    """Whether the target's own layer has these very values, which stays its own."""


@dataclass(frozen=True, eq=False)
class Transfer:
    """Everything that a transfer will write, computed before anything is written.

    Attributes
    ----------
    layers : tuple of Carried
        What will be written.
    keys : KeyPlan or None
        What becomes of the target's shape keys as a whole, if any are carried.
    shown_uv, shown_color : str or None
        UV map and color attribute to render with: the source's, where the target had none of its own, or where all
        its faces get materials that are made for them.
    warnings : tuple of str
        Sentences about what will not be written, or not under its own name.
    unmatched : Unmatched
        The part of the target that corresponds to nothing, and what is done about it.
    textures : Textures or None
        Pictures, if any are carried.
    rig : Rig or None
        The armature, if it is carried.
    """

    layers: tuple[Carried, ...]
    keys: KeyPlan | None
    shown_uv: str | None
    shown_color: str | None
    warnings: tuple[str, ...]
    unmatched: Unmatched
    textures: Textures | None = None
    rig: Rig | None = None

    def write(self, obj: bpy.types.Object) -> None:
        """Write every layer on the target; if that fails, the target is as it was."""
        write_transfers([(obj, self)])

    def counts(self) -> dict[str, int]:
        """Return how many layers of each kind are written, kinds with none left out."""
        found = {kind.identifier: sum(x.row.kind == kind.identifier for x in self.layers) for kind in KINDS}
        if self.textures is not None:
            found["textures"] = len(self.textures.made) + len(self.textures.colors)
        return {kind: number for kind, number in found.items() if number}


def write_transfers(pairs: Sequence[tuple[bpy.types.Object, Transfer]]) -> None:
    """Write what was carried to each target; if one of them fails, all are as they were."""
    with made_or_removed() as made, restored_on_failure(*(obj for obj, _ in pairs)):
        for obj, transfer in pairs:
            _write(obj, transfer, made)


def _write(obj: bpy.types.Object, transfer: Transfer, made: list[Any]) -> None:
    mesh = obj.data
    order = [group.name for group in obj.vertex_groups]
    earlier = unedited(obj)
    if transfer.keys is not None:
        transfer.keys.prepare(obj)
    with _active_layers_kept(obj):
        for layer in transfer.layers:
            layer.row.access.write(obj, layer.name, layer.values, layer.covered, layer.about)
    keep_order(obj, order)
    if transfer.keys is not None:
        transfer.keys.finish(obj)
    # what was written before may have moved with what was written now, as shape keys do
    remember(obj, earlier, [(x.row.kind, x.name, x.source_name) for x in transfer.layers if not x.own])
    if transfer.shown_uv is not None:
        mesh.uv_layers.active = mesh.uv_layers[transfer.shown_uv]
        mesh.uv_layers[transfer.shown_uv].active_render = True
    if transfer.shown_color is not None:
        mesh.attributes.active_color_name = mesh.attributes.default_color_name = transfer.shown_color
    if transfer.textures is not None:
        source_map = transfer.textures.layout.source_name
        written = {x.source_name: x.name for x in transfer.layers if x.row.kind == "uv"}
        write_textures(obj, transfer.textures, made, written.get(source_map) if source_map else None)
    if transfer.rig is not None:
        write_rig(obj, transfer.rig)


@contextmanager
def _active_layers_kept(obj: bpy.types.Object) -> Iterator[None]:
    """Leave those UV maps, colors and shape keys active that were, and that is rendered which was."""
    mesh, attributes = obj.data, obj.data.attributes
    active = mesh.uv_layers.active.name if mesh.uv_layers.active else None
    render = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    colors = attributes.active_color_name, attributes.default_color_name
    key = obj.active_shape_key.name if obj.active_shape_key else None
    yield
    if active is not None:
        mesh.uv_layers.active = mesh.uv_layers[active]
    if render is not None:
        mesh.uv_layers[render].active_render = True
    if colors[0]:
        attributes.active_color_name = colors[0]
    if colors[1]:
        attributes.default_color_name = colors[1]
    if key is not None:
        obj.active_shape_key_index = mesh.shape_keys.key_blocks.find(key)


@contextmanager
def restored_on_failure(*objects: bpy.types.Object) -> Iterator[None]:
    """Put the objects' meshes back as they were if the body fails: Blender takes no undo step of a failed operator."""
    with ExitStack() as stack:
        for obj in objects:
            stack.enter_context(_restored(obj))
        yield


@contextmanager
def _restored(obj: bpy.types.Object) -> Iterator[None]:
    mesh = obj.data
    keys = mesh.shape_keys
    names = mesh.name, keys.name if keys else ""
    backup = mesh.copy()  # layers are shared until they are written: this costs next to nothing
    action = _key_action(mesh)
    try:
        yield
    except BaseException:
        failed = obj.data  # another mesh than before if one of these inside this one has put it back
        made = _key_action(failed)
        failed.user_remap(backup)
        if failed.users:  # a mesh in Edit Mode is not exchanged, and to remove it would remove its objects
            bpy.data.meshes.remove(backup)
            raise
        bpy.data.meshes.remove(failed)
        if made is not None and made != action and not made.users:
            bpy.data.actions.remove(made)
        backup.name = names[0]
        if backup.shape_keys:
            backup.shape_keys.name = names[1]
        raise
    bpy.data.meshes.remove(backup)
    made = _key_action(mesh)
    if action is not None and made is not None and made != action and action.users == int(action.use_fake_user):
        # keyframes were added to a copy of the action, which takes its place
        name, made.use_fake_user = action.name, action.use_fake_user
        bpy.data.actions.remove(action)
        made.name = name


def _key_action(mesh: bpy.types.Mesh) -> bpy.types.Action | None:
    """Return the action that moves the sliders of a mesh."""
    keys = mesh.shape_keys
    return keys.animation_data.action if keys is not None and keys.animation_data is not None else None
