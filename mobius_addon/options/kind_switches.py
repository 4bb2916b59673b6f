"""A checkbox for each kind of data: the same choice as the enumeration `kinds`, which clicks can only replace."""

# no postponed annotations here: Blender reads the properties from them
from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..attributes import KINDS, ROWS, Kind
from ..textures.nodes import picture_count


def enum_identifier(kind: str) -> str:
    """Return how Blender's enumerations spell a kind of data: 'vertex-groups' is 'VERTEX_GROUPS'."""
    return kind.upper().replace("-", "_")


def _switch(kind: Kind) -> Any:
    """Return the property that is true while a kind is chosen."""
    identifier = enum_identifier(kind.identifier)

    def is_chosen(owner: Any) -> bool:
        return identifier in owner.kinds

    def choose(owner: Any, chosen: bool) -> None:
        owner.kinds = set(owner.kinds) | {identifier} if chosen else set(owner.kinds) - {identifier}

    return bpy.props.BoolProperty(
        name=kind.label, description=kind.description, get=is_chosen, set=choose, options={"SKIP_SAVE", "HIDDEN"}
    )


def _all_or_none(name: str, description: str, chosen: set[str]) -> Any:
    """Return the property of a button that chooses all kinds or none."""
    act: Callable[[Any, bool], None] = lambda owner, _: setattr(owner, "kinds", chosen)  # noqa: E731
    return bpy.props.BoolProperty(
        name=name,
        description=description,
        get=lambda owner: set(owner.kinds) == chosen,
        set=act,
        options={"SKIP_SAVE", "HIDDEN"},
    )


class KindSwitches:
    """Mixin for what has the enumeration `kinds`: `carry_...` for each of its items, and for all and none."""

    __annotations__ = {
        **{f"carry_{kind.identifier.replace('-', '_')}": _switch(kind) for kind in KINDS},
        "carry_all": _all_or_none("All", "Carry every kind of data", {enum_identifier(x.identifier) for x in KINDS}),
        "carry_none": _all_or_none("None", "Carry no kind of data, to choose some", set()),
    }


def draw_kinds(layout: bpy.types.UILayout, options: Any, source: bpy.types.Object | None) -> None:
    """Draw the checkboxes, with how many layers of each kind the source has."""
    row = layout.row(align=True)
    row.use_property_split = False
    row.prop(options, "carry_all", toggle=True)
    row.prop(options, "carry_none", toggle=True)
    column = layout.column(align=True)
    column.use_property_split = False
    counts = _counts(source)
    for kind in KINDS:
        line = column.row()
        line.active = counts is None or counts[kind.identifier] > 0
        number = f" {counts[kind.identifier]}" if counts and kind.identifier not in _ONCE else ""
        name = f"carry_{kind.identifier.replace('-', '_')}"
        line.prop(options, name, text=iface_(kind.label) + number, translate=False)


_ONCE = frozenset(row.kind for row in ROWS if row.once)
"""Kinds of which a mesh has one, so that a number would say nothing."""


def _counts(source: bpy.types.Object | None) -> dict[str, int] | None:
    """Return how many layers of each kind a source has, None if it cannot be said."""
    if source is None or source.type != "MESH" or source.mode != "OBJECT":
        return None
    layers = {
        kind.identifier: sum(len(x.access.names(source)) for x in ROWS if x.kind == kind.identifier) for kind in KINDS
    }
    return layers | {"textures": picture_count(source)}
