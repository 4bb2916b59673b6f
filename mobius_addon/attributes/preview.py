"""What a transfer will do to layers of the target's own, told from names alone, quickly enough to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..mesh_data import Refusal
from .chosen import chosen_layers
from .placing import holds_nothing, joins
from .record import written_on
from .settings import TransferSettings
from .table import KINDS, ROWS

_LABELS = {kind.identifier: kind.label for kind in KINDS}


@dataclass(frozen=True)
class Preview:
    """Layers of the target that have the names of carried ones.

    Attributes
    ----------
    kept : tuple of str
        Names of layers that stay beside the carried ones, if they differ.
    replaced : tuple of str
        Names of layers that take the carried values.
    kinds : tuple of str
        Labels of kinds that the mesh has once and that take the carried values.
    """

    kept: tuple[str, ...]
    replaced: tuple[str, ...]
    kinds: tuple[str, ...]


def preview(source: bpy.types.Object, target: bpy.types.Object, settings: TransferSettings) -> Preview:
    """Return which layers of the target the carried ones meet.

    What an earlier transfer wrote is left out; whether it has been edited since is not looked at here.
    """
    earlier = {(x.kind, x.name) for x in written_on(target.data)}
    kept: list[str] = []
    replaced: list[str] = []
    kinds: list[str] = []
    for row in ROWS:
        if row.kind not in settings.kinds:
            continue
        try:
            chosen = chosen_layers(row.kind, source, target, settings)
        except Refusal:  # said when it is carried
            continue
        there = {name for name in row.access.names(target) if (row.kind, name) not in earlier}
        if row.marks:  # most meshes have them, and nothing in them
            there = {name for name, x in row.access.existing(target, list(there)).items() if not holds_nothing(row, x)}
        if not there:
            continue
        given = [name for name in row.access.names(source) if row.once or chosen(name)]
        if row.once:
            kinds += [_LABELS[row.kind]] if given else []
        elif settings.collisions == "replace" or joins(row, settings):
            replaced += [name for name in given if name in there]
        else:
            kept += [name for name in given if name in there]
    return Preview(*(tuple(dict.fromkeys(found)) for found in (kept, replaced, kinds)))
