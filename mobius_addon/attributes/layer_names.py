"""What carried layers are called on the target: as on the source, spelled another way, or with the sides exchanged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy

from ...solver.surface.mesh import plural
from .access import Layer
from .expression_names import Spelling, renamed


def named_layers(
    kind: str, layers: Sequence[Layer], spelling: Spelling, mirrors: bool, *, join: bool = True
) -> tuple[list[tuple[Layer, str]], list[str]]:
    """Return layers with the names that they are to have, and sentences about it.

    Where the map mirrors, left and right change places in the names of vertex groups and shape keys, as Blender flips
    them. Halves that become one shape key are added up, if they may `join`; it has the slider of the first.
    """
    if kind not in ("vertex-groups", "shape-keys") or (spelling == "keep" and not mirrors):
        return [(layer, layer.name) for layer in layers], []
    flipped = bpy.utils.flip_name if mirrors else None
    there = {layer.name: layer for layer in layers}
    result = []
    for name, parts in renamed(there, spelling if kind == "shape-keys" else "keep", flipped, join=join).items():
        first = there[parts[0]]
        for part in parts[1:]:
            first = replace(first, values=first.values + there[part].values)
        result.append((first, name))
    notes = []
    turned = sum(bpy.utils.flip_name(layer.name) != layer.name for layer in layers) if mirrors else 0
    if turned:
        noun = "vertex group" if kind == "vertex-groups" else "shape key"
        notes.append(f"the map mirrors: left and right have changed places in the names of {plural(turned, noun)}")
    return result, notes
