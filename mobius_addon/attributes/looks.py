"""What the target is rendered with after a transfer, and what carried materials expect to find there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from .access import OWN_NAMES
from .plan import Carried


@dataclass(frozen=True)
class Looks:
    """What of source and target is rendered.

    Attributes
    ----------
    uv, color : str
        UV map and color attribute that the source is rendered with.
    has_uv, has_color : bool
        Whether the target has one of its own.
    named : tuple of (str, str)
        Materials of the source, and UV maps and attributes that they name.
    """

    uv: str
    color: str
    has_uv: bool
    has_color: bool
    named: tuple[tuple[str, str], ...]

    def shown(self, layers: Sequence[Carried], names: tuple[str, str]) -> tuple[str | None, str | None, list[str]]:
        """Return the UV map and the color to render the target with, None: as it is; and sentences about it.

        `names` are those of source and target.
        """
        maps = {x.source_name: x.name for x in layers if x.row.kind == "uv"}
        colors = {x.source_name: x.name for x in layers if x.row.kind == "colors"}
        materials = next((x for x in layers if x.row.kind == "materials"), None)
        uv = None if self.has_uv else maps.get(self.uv, next(iter(maps.values()), None))
        color = None if self.has_color else colors.get(self.color, next(iter(colors.values()), None))
        if materials is None:
            return uv, color, []
        notes = []
        dressed = bool(materials.covered.all()) and any(material is not None for material in materials.about)
        moved = maps.get(self.uv)
        if self.has_uv and dressed and moved is not None and moved != self.uv:
            uv = moved
            notes.append(f"'{names[1]}' is rendered with the UV map '{moved}', as its carried materials expect")
        elif moved is not None and moved != self.uv:
            notes.append(f"materials of '{names[0]}' were made for the UV map '{self.uv}', here '{moved}': choose it")
        for material, name in self.named:
            now = maps.get(name, colors.get(name, name))
            if now != name:
                notes.append(f"the nodes of material '{material}' name '{name}', which is '{now}' on '{names[1]}'")
        return uv, color, notes


def looks_of(source: bpy.types.Object, target: bpy.types.Object) -> Looks:
    """Return what is rendered of both objects."""
    uv = next((x.name for x in source.data.uv_layers if x.active_render), "")
    named = tuple(
        sorted(
            {
                (slot.material.name, name)
                for slot in source.material_slots
                if slot.material is not None and slot.material.node_tree is not None
                for name in _layers_named_in(slot.material.node_tree)
            }
        )
    )
    return Looks(
        uv,
        source.data.attributes.default_color_name,
        _has_own(target.data.uv_layers),
        _has_own(target.data.color_attributes),
        named,
    )


def _has_own(layers: Iterable[Any]) -> bool:
    return any(layer.name not in OWN_NAMES for layer in layers)


def _layers_named_in(tree: bpy.types.NodeTree) -> Iterator[str]:
    """Yield the names of UV maps and attributes in the nodes of a tree and of the groups in it."""
    waiting, done = [tree], set()
    while waiting:
        tree = waiting.pop()
        if tree in done:
            continue
        done.add(tree)
        for node in tree.nodes:
            names = (getattr(node, key, "") for key in ("uv_map", "layer_name", "attribute_name"))
            yield from (name for name in names if isinstance(name, str) and name)
            if isinstance(inner := getattr(node, "node_tree", None), bpy.types.NodeTree):
                waiting.append(inner)
