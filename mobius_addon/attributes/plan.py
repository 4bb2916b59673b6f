"""A transfer: everything read first, then computed, then written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...solver import Cancelled, Progress
from ...solver.surface.mesh import Booleans, Floats
from ..mesh_data import Refusal
from .access import MAX_UV_MAPS, OWN_NAMES
from .carrier import Carrier, Values
from .chosen import chosen_layers
from .settings import TransferSettings
from .table import KINDS, ROWS, Row
from .unmatched import Unmatched
from .vertex_groups import keep_order, read_weights
from .weights import tidied

_LABELS = {kind.identifier: kind.label for kind in KINDS}


@dataclass(frozen=True, eq=False)
class Carried:
    """A layer on its way: computed for the target, not yet written."""

    row: Row
    source_name: str
    name: str
    values: Values
    covered: Booleans
    about: Any


@dataclass(frozen=True, eq=False)
class Transfer:
    """Everything that a transfer will write, computed before anything is written.

    Attributes
    ----------
    layers : tuple of Carried
        What will be written.
    shown_uv, shown_color : str or None
        UV map and color attribute to render with: the source's, where the target had none of its own.
    warnings : tuple of str
        Sentences about what will not be written, or not under its own name.
    unmatched : Unmatched
        The part of the target that corresponds to nothing, and what is done about it.
    """

    layers: tuple[Carried, ...]
    shown_uv: str | None
    shown_color: str | None
    warnings: tuple[str, ...]
    unmatched: Unmatched

    def write(self, obj: bpy.types.Object) -> None:
        """Write every layer on the target; if that fails, the target is as it was."""
        write_transfers([(obj, self)])

    def counts(self) -> dict[str, int]:
        """Return how many layers of each kind are written, kinds with none left out."""
        found = {kind.identifier: sum(x.row.kind == kind.identifier for x in self.layers) for kind in KINDS}
        return {kind: number for kind, number in found.items() if number}


@dataclass(frozen=True, eq=False)
class _Pending:
    """A layer that was read and who carries it: `there` is what the target has under the name, if that matters."""

    row: Row
    carrier: Carrier
    source_name: str
    name: str
    values: Values
    there: Values | None
    about: Any


@dataclass(frozen=True, eq=False)
class Reading:
    """Everything that a transfer needs of the two objects, as arrays: `carry` may run in a thread of its own."""

    pending: tuple[_Pending, ...]
    carrier: Carrier
    settings: TransferSettings
    influence: Floats | None
    locked: Floats | None
    shown: tuple[str | None, str | None]
    warnings: tuple[str, ...]
    names: tuple[str, str]
    unmatched: Unmatched

    def carry(self, progress: Callable[[Progress], bool | None] | None = None) -> Transfer:
        """Carry every layer.

        Raises
        ------
        Cancelled
            The progress callback returned False.
        Refusal
            Nothing is left to write.
        """
        warnings = list(self.warnings)
        layers = []
        for number, pending in enumerate(self.pending):
            step = Progress(f"{_LABELS[pending.row.kind]} of '{self.names[1]}'", number / len(self.pending))
            if progress is not None and progress(step) is False:
                raise Cancelled
            carried = self._carried(pending)
            if pending.row.marks:
                # flags that most meshes have: no word about those that stay as they are
                if not _changes(carried, pending.there):
                    continue
                if carried.name != carried.source_name:
                    name = carried.source_name
                    warnings.append(f"'{self.names[1]}' has an attribute of another type named '{name}': delete it")
                    continue
            layers.append(carried)
        if not layers:
            raise Refusal(_nothing(self.names[0], self.settings, warnings))
        layers = self._tidied(layers)
        shown_uv, shown_color = (
            _renamed(layers, kind, name) for kind, name in zip(("uv", "colors"), self.shown, strict=True)
        )
        warnings += self.unmatched.warnings(self.names[1])
        return Transfer(tuple(layers), shown_uv, shown_color, tuple(warnings), self.unmatched)

    def _carried(self, pending: _Pending) -> Carried:
        row, settings = pending.row, self.settings
        values, covered = row.carry(pending.carrier, pending.values)
        share = np.ones(len(values))
        if self.influence is not None:
            share = self.carrier.at(row.access.domain, self.influence)
        if row.mixes:
            covered = covered & (share > 0)
            values = _mixed(values, pending.there, settings.mix, settings.mix_factor * share)
        else:
            covered = covered & (share >= 0.5)
        return Carried(row, pending.source_name, pending.name, values, covered, pending.about)

    def _tidied(self, layers: list[Carried]) -> list[Carried]:
        groups = [x for x in layers if x.row.kind == "vertex-groups"]
        if not groups:
            return layers
        columns = tidied(
            np.clip(np.stack([x.values for x in groups], axis=1), 0, 1),
            groups[0].covered,
            smallest=self.settings.smallest_weight,
            limit=self.settings.limit,
            normalize=self.settings.normalize,
            locked=self.locked,
        )
        done = iter([replace(x, values=column) for x, column in zip(groups, columns.T, strict=True)])
        return [next(done) if x.row.kind == "vertex-groups" else x for x in layers]


def read_transfer(
    source: bpy.types.Object,
    target: bpy.types.Object,
    carrier: Carrier,
    settings: TransferSettings,
    *,
    shown_source: bpy.types.Object | None = None,
    keys_carrier: Carrier | None = None,
    influence: Floats | None = None,
    unmatched: Unmatched | None = None,
) -> Reading:
    """Read everything of the chosen kinds from the source, and what matters to it of the target.

    Parameters
    ----------
    source, target : bpy.types.Object
        Mesh objects in Object Mode.
    carrier : Carrier
        The correspondence between them.
    settings : TransferSettings
    shown_source : bpy.types.Object, optional
        The evaluated source, to read layers from; shape keys are the source's own.
    keys_carrier : Carrier, optional
        The correspondence with the source's own mesh, for shape keys, if `carrier` is one with an evaluated mesh that
        has other vertices.
    influence : (n_target,) float, optional
        The target's mask, in [0, 1]; None: 1.
    unmatched : Unmatched, optional
        What is unmatched and what `carrier` does about it; by default what it says itself.

    Raises
    ------
    Refusal
        Nothing to carry, or more UV maps than Blender allows.
    """
    pending: list[_Pending] = []
    warnings: list[str] = []
    locked: list[str] = []
    for row in ROWS:
        if row.kind not in settings.kinds:
            continue
        whence, way = shown_source or source, carrier
        if row.kind == "shape-keys":
            whence, way = source, keys_carrier or carrier
        found: list[_Pending] = []
        for layer in row.access.layers(whence, chosen_layers(row.kind, source, target, settings)):
            taken = {x.name for x in (*pending, *found)}
            name = row.access.place(target, layer.name, taken, number=settings.collisions == "number" and not row.marks)
            if name is None:
                warnings.append(f"'{layer.name}' is locked on '{target.name}' and left as it is")
                locked += [layer.name] if row.kind == "vertex-groups" else []
                continue
            if name != layer.name and not row.marks and settings.collisions == "replace":
                warnings.append(f"'{target.name}' has something else named '{layer.name}': it becomes '{name}'")
            found.append(_Pending(row, way, layer.name, name, layer.values, None, layer.about))
        if row.mixes or row.marks:
            there = row.access.existing(target, [x.name for x in found])
            found = [replace(x, there=there.get(x.name)) for x in found]
        pending += found
    if not pending:
        raise Refusal(_nothing(source.name, settings, warnings))
    maps = {x.name for x in pending if x.row.kind == "uv"} | {x.name for x in target.data.uv_layers}
    if len(maps) > MAX_UV_MAPS:
        raise Refusal(
            f"'{target.name}' would have {len(maps)} UV maps and Blender allows {MAX_UV_MAPS}: delete some first"
        )
    if target.data.users > 1:
        warnings.append(f"'{target.name}' shares its mesh with other objects: they change with it")
    fixed = None
    if locked and settings.normalize:
        fixed = read_weights(target, locked).sum(axis=1)
    shown_uv = next((x.name for x in source.data.uv_layers if x.active_render), "")
    return Reading(
        tuple(pending),
        carrier,
        settings,
        influence,
        fixed,
        (
            _shown(shown_uv, target.data.uv_layers),
            _shown(source.data.attributes.default_color_name, target.data.color_attributes),
        ),
        tuple(warnings),
        (source.name, target.name),
        unmatched or Unmatched.of(carrier),
    )


def plan_transfer(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier, settings: TransferSettings | None = None
) -> Transfer:
    """Carry everything of the chosen kinds from source to target, without writing yet; see `read_transfer`."""
    return read_transfer(source, target, carrier, settings or TransferSettings()).carry()


def _mixed(values: Values, there: Values | None, mix: str, share: Floats) -> Values:
    """Return what is there and the carried values joined, going the share, (n,), of the way; missing ones are 0."""
    if mix == "replace" and (share == 1).all():
        return values
    old = np.zeros(values.shape) if there is None else there.astype(np.float64)
    joined = {"replace": values, "add": old + values, "subtract": old - values, "multiply": old * values}[mix]
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.where(share == 1, joined, old + share * (joined - old))


def _changes(carried: Carried, there: Values | None) -> bool:
    """Return whether writing a layer would change what is there; what is missing counts as zeros."""
    new = carried.values[carried.covered]
    if there is None:
        return bool(new.any())
    return bool((new.astype(there.dtype) != there[carried.covered]).any())


def _nothing(source: str, settings: TransferSettings, warnings: Iterable[str]) -> str:
    wanted = " or ".join(kind.noun for kind in KINDS if kind.identifier in settings.kinds)
    which = {"all": "", "active": "active ", "named": "so named "}[settings.layers]
    why = "; ".join(warnings)
    return f"'{source}' has no {which}{wanted} to transfer" + (f" ({why})" if why else "")


def _shown(shown_on_source: str, on_target: Iterable[bpy.types.Attribute]) -> str | None:
    """Return which layer of the source to render with, or None if the target has one of its own."""
    return None if any(x.name not in OWN_NAMES for x in on_target) else shown_on_source


def _renamed(layers: list[Carried], kind: str, shown: str | None) -> str | None:
    """Return under which name a layer of the source is written, the first of its kind for want of it."""
    names = {x.source_name: x.name for x in layers if x.row.kind == kind}
    return None if shown is None else names.get(shown, next(iter(names.values()), None))


def write_transfers(pairs: Sequence[tuple[bpy.types.Object, Transfer]]) -> None:
    """Write what was carried to each target; if one of them fails, all are as they were."""
    with ExitStack() as stack:
        for obj, _ in pairs:
            stack.enter_context(restored_on_failure(obj))
        for obj, transfer in pairs:
            _write(obj, transfer)


def _write(obj: bpy.types.Object, transfer: Transfer) -> None:
    order = [group.name for group in obj.vertex_groups]
    for layer in transfer.layers:
        layer.row.access.write(obj, layer.name, layer.values, layer.covered, layer.about)
    keep_order(obj, order)
    mesh = obj.data
    if transfer.shown_uv is not None:
        mesh.uv_layers.active = mesh.uv_layers[transfer.shown_uv]
        mesh.uv_layers[transfer.shown_uv].active_render = True
    if transfer.shown_color is not None:
        mesh.attributes.active_color_name = mesh.attributes.default_color_name = transfer.shown_color


@contextmanager
def restored_on_failure(obj: bpy.types.Object) -> Iterator[None]:
    """Put the object's mesh back as it was if the body fails: Blender takes no undo step of a failed operator."""
    mesh = obj.data
    keys = mesh.shape_keys
    names = mesh.name, keys.name if keys else ""
    backup = mesh.copy()  # layers are shared until they are written: this costs next to nothing
    try:
        yield
    except BaseException:
        failed = obj.data  # another mesh than before if one of these inside this one has put it back
        failed.user_remap(backup)
        if failed.users:  # a mesh in Edit Mode is not exchanged, and to remove it would remove its objects
            bpy.data.meshes.remove(backup)
            raise
        bpy.data.meshes.remove(failed)
        backup.name = names[0]
        if backup.shape_keys:
            backup.shape_keys.name = names[1]
        raise
    bpy.data.meshes.remove(backup)
