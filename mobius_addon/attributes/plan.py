"""A transfer: everything computed first, then written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy

from ...solver.mesh import Booleans
from ..mesh_data import Refusal
from .access import MAX_UV_MAPS, OWN_NAMES, AttributeAccess
from .carrier import Carrier, Values
from .table import KINDS, ROWS, Row


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
    """

    layers: tuple[Carried, ...]
    shown_uv: str | None
    shown_color: str | None
    warnings: tuple[str, ...]

    def write(self, obj: bpy.types.Object) -> None:
        """Write every layer on the target."""
        for layer in self.layers:
            layer.row.access.write(obj, layer.name, layer.values, layer.covered, layer.about)
        mesh = obj.data
        if self.shown_uv is not None:
            mesh.uv_layers.active = mesh.uv_layers[self.shown_uv]
            mesh.uv_layers[self.shown_uv].active_render = True
        if self.shown_color is not None:
            mesh.attributes.active_color_name = mesh.attributes.default_color_name = self.shown_color

    def counts(self) -> dict[str, int]:
        """Return how many layers of each kind are written, kinds with none left out."""
        found = {kind.identifier: sum(x.row.kind == kind.identifier for x in self.layers) for kind in KINDS}
        return {kind: number for kind, number in found.items() if number}


def plan_transfer(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier, kinds: Iterable[str]
) -> Transfer:
    """Carry everything of the chosen kinds from source to target, without writing yet.

    Parameters
    ----------
    source, target : bpy.types.Object
        Mesh objects in Object Mode.
    carrier : Carrier
        The correspondence between them.
    kinds : iterable of str
        Identifiers of `KINDS`.

    Raises
    ------
    Refusal
        Nothing to carry, or more UV maps than Blender allows.
    """
    chosen = set(kinds)
    layers: list[Carried] = []
    warnings: list[str] = []
    for row in ROWS:
        if row.kind not in chosen:
            continue
        for layer in row.access.layers(source):
            name = row.access.place(target, layer.name, {x.name for x in layers})
            if name is None:
                warnings.append(f"'{layer.name}' is locked on '{target.name}' and left as it is")
                continue
            values, covered = row.carry(carrier, layer.values)
            if isinstance(row.access, AttributeAccess) and row.access.only:
                # flags that most meshes have: no word about those that stay as they are
                if not row.access.changes(target, layer.name, values, covered):
                    continue
                if name != layer.name:
                    warnings.append(f"'{target.name}' has an attribute of another type named '{layer.name}': delete it")
                    continue
            if name != layer.name:
                warnings.append(f"'{target.name}' has something else named '{layer.name}': it becomes '{name}'")
            layers.append(Carried(row, layer.name, name, values, covered, layer.about))
    if not layers:
        wanted = " or ".join(kind.noun for kind in KINDS if kind.identifier in chosen)
        locked = f" ({'; '.join(warnings)})" if warnings else ""
        raise Refusal(f"'{source.name}' has no {wanted} to transfer{locked}")
    maps = {x.name for x in layers if x.row.kind == "uv"} | {x.name for x in target.data.uv_layers}
    if len(maps) > MAX_UV_MAPS:
        raise Refusal(
            f"'{target.name}' would have {len(maps)} UV maps and Blender allows {MAX_UV_MAPS}: delete some first"
        )
    if bare := int((carrier.correspondence.face < 0).sum()):
        warnings.append(f"{bare:,} vertices of '{target.name}' have no counterpart and are left as they were")
    shown_uv = next((x.name for x in source.data.uv_layers if x.active_render), "")
    return Transfer(
        tuple(layers),
        _shown(layers, "uv", shown_uv, target.data.uv_layers),
        _shown(layers, "colors", source.data.attributes.default_color_name, target.data.color_attributes),
        tuple(warnings),
    )


def _shown(
    layers: list[Carried], kind: str, shown_on_source: str, on_target: Iterable[bpy.types.Attribute]
) -> str | None:
    """Return which carried layer to render with, or None if the target has one of its own."""
    if any(x.name not in OWN_NAMES for x in on_target):
        return None
    names = {x.source_name: x.name for x in layers if x.row.kind == kind}
    return names.get(shown_on_source, next(iter(names.values()), None))
