"""What was carried to several objects as to one: the share of each, written on all of them or on none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...solver import Correspondence
from ...solver.surface.mesh import Floats
from ..joined import Member
from .fitted_rig import share_rig
from .normals import NormalAccess
from .placing import holds_nothing
from .plan import Carried, Transfer, write_transfers
from .shape_keys import ShapeKeyAccess


def write_shares(
    transfer: Transfer, members: Sequence[Member], sources: Sequence[Member], found: Correspondence
) -> None:
    """Write on each of the objects that were joined what was carried to its part of the whole.

    Parameters
    ----------
    transfer : Transfer
        What was carried to the whole.
    members, sources : sequence of Member
        The objects of the target, and those of the source, none if it is a single one.
    found : Correspondence
        Between the two wholes. A layer comes to an object from those of the source's objects that it is matched with,
        and not where they do not have it, or it would be without weight or movement there.
    """
    pairs = [
        (member.obj, share_of(transfer, member, _givers(member, sources, found), first=number == 0))
        for number, member in enumerate(members)
    ]
    write_transfers(pairs)
    if transfer.rig is not None:
        share_rig(members[0].obj, [member.obj for member in members[1:]], transfer.rig)


def _givers(member: Member, sources: Sequence[Member], found: Correspondence) -> list[bpy.types.Object] | None:
    """Return those of the source's objects that an object's vertices lie on, None if the source is a single one."""
    if not sources:
        return None
    owner = np.empty(found.source_size, np.intp)
    for number, source in enumerate(sources):
        owner[source.numbers["POINT"]] = number
    face = found.face[member.numbers["POINT"]]
    return [sources[k].obj for k in np.unique(owner[found.source_triangles[face[face >= 0], 0]])]


def share_of(transfer: Transfer, member: Member, givers: list[bpy.types.Object] | None, *, first: bool) -> Transfer:
    """Return what of a transfer is one object's; the rig goes to the first. See `write_shares`."""
    layers = tuple(x for layer in transfer.layers if _belongs(x := _share(layer, member), member.obj, givers))
    keys = transfer.keys if any(x.row.kind == "shape-keys" for x in layers) else None
    names = {kind: {x.name for x in layers if x.row.kind == kind} for kind in ("uv", "colors", "shape-keys")}
    if keys is not None:
        there = names["shape-keys"]
        keys = replace(
            keys,
            names={old: new for old, new in keys.names.items() if new in there},
            halves={old: new for old, new in keys.halves.items() if new in there},
        )
    return replace(
        transfer,
        layers=layers,
        keys=keys,
        shown_uv=transfer.shown_uv if transfer.shown_uv in names["uv"] else None,
        shown_color=transfer.shown_color if transfer.shown_color in names["colors"] else None,
        rig=transfer.rig if first else None,
    )


def _share(layer: Carried, member: Member) -> Carried:
    own = member.numbers[layer.row.access.domain]
    values, about = layer.values[own], layer.about
    if isinstance(layer.row.access, ShapeKeyAccess):
        values = values @ member.turn.T
    elif isinstance(layer.row.access, NormalAccess):
        values = _unit(values @ np.linalg.inv(member.turn))
    return replace(layer, values=values, covered=layer.covered[own], about=about)


def _belongs(layer: Carried, obj: bpy.types.Object, givers: list[bpy.types.Object] | None) -> bool:
    row = layer.row
    if not layer.covered.any():
        return False
    if givers is not None and not any(layer.source_name in row.access.names(giver) for giver in givers):
        return False
    if row.access.existing(obj, [layer.name]):
        return True
    return not holds_nothing(row, layer.values[layer.covered])


def _unit(normals: Floats) -> Floats:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, length, out=normals, where=length > 0)
