"""Layers of data on a mesh: how attributes of every type are found, read and written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import count
from typing import Any, Protocol

import bpy
import numpy as np

from ...solver.surface.mesh import Booleans
from ..heat_maps import DISC_MEASURES, MAP_MEASURES
from ..mesh_data import Refusal, foreach
from .carrier import Values

DISC_LAYOUT = "Mobius Disc"
SHARED_LAYOUT = "Mobius"
SHARED_COLOR = "Mobius Color"
MATCHED_GROUP = "Mobius Matched"
PATTERN_COLOR = "Mobius Pattern"
LIVE_FACE = "Mobius Map Face"
LIVE_CORNERS = ("Mobius Map Corner 1", "Mobius Map Corner 2", "Mobius Map Corner 3")
LIVE_WEIGHTS = "Mobius Map Weights"
LIVE_MATCHED = "Mobius Map Matched"
LIVE_CONFIDENCE = "Mobius Map Confidence"
LIVE_NAMES = (LIVE_FACE, *LIVE_CORNERS, LIVE_WEIGHTS, LIVE_MATCHED, LIVE_CONFIDENCE)
"""The correspondence, as nodes read it."""

OWN_NAMES = frozenset(
    {DISC_LAYOUT, SHARED_LAYOUT, SHARED_COLOR, MATCHED_GROUP, PATTERN_COLOR, *LIVE_NAMES}
    | {measure.attribute for measure in (*DISC_MEASURES, *MAP_MEASURES)}
)
"""Names of what our own operators write to be looked at; they are no content to carry."""

MAX_UV_MAPS = 8

SHARPNESS = frozenset(
    {"crease_edge", "crease_vert", "bevel_weight_edge", "bevel_weight_vert", "sharp_edge", "freestyle_edge"}
)
SEAMS = frozenset({"uv_seam", ".uv_seam"})
FACE_SETS = frozenset({".sculpt_face_set"})
SCULPT_MASK = frozenset({".sculpt_mask"})
SMOOTHNESS = frozenset({"sharp_face", "freestyle_face"})
BUILT_IN = frozenset({"position", "custom_normal", "material_index", *SHARPNESS, *SEAMS, *SMOOTHNESS})
"""Names that have a meaning of their own to Blender."""


@dataclass(frozen=True, eq=False)
class Layer:
    """One named piece of data of a mesh, with its values per element of its domain.

    `about` is what else its `Access` wants to know of it when it writes it.
    """

    name: str
    values: Values
    about: Any = None


class Access(Protocol):
    """How one type of data is found on an object, read and written."""

    @property
    def domain(self) -> str:
        """What elements of the mesh have a value: "POINT", "EDGE", "FACE" or "CORNER"."""
        ...

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the names of the layers of this type, except those that are not the person's own content."""
        ...

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read those of the layers that `names` gives whose names are chosen."""
        ...

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str | None:
        """Return the name under which `write` will store a layer, or None where the person has locked it.

        `reserved` are the names that other layers of the same transfer take. With `number`, a layer that is there
        already is not replaced: the name gets Blender's number. What a mesh has once is never numbered.
        """
        ...

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Read those of the layers of these names that are there, in a form in which they can be compared."""
        ...

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the layer or replace its values, leaving what is there where `covered` is False."""
        ...


@dataclass(frozen=True)
class AttributeAccess:
    """Attributes of one Blender data type on one domain; UV maps and color attributes are such attributes.

    Parameters
    ----------
    data_type, domain : str
        As in `bpy.types.Attribute`.
    prop : str
        What `foreach_get` calls the value. Byte colors are read as linear values, in which they can be interpolated;
        writing the same values back restores the stored bytes.
    width : int
        Numbers per element.
    dtype : str
        What numpy calls one of them.
    only : frozenset of str
        Names that are read, whatever they begin with; all but `BUILT_IN` where there are none.
    """

    data_type: str
    domain: str
    prop: str
    width: int
    dtype: str = "float32"
    only: frozenset[str] = frozenset()

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the names of attributes of this type and domain that are content, or those of `only`."""
        there = [a.name for a in obj.data.attributes if self._is_own_kind(a)]
        if self.only:
            return [name for name in there if name in self.only]
        return [x for x in there if x not in BUILT_IN and x not in OWN_NAMES and not x.startswith(".")]

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the chosen attributes of this type and domain; those of `only` always are."""
        for name in self.names(obj):
            if self.only or chosen(name):
                yield Layer(name, self.read(obj, name))

    def read(self, obj: bpy.types.Object, name: str) -> Values:
        """Return the values of an attribute of this type."""
        data = obj.data.attributes[name].data
        if self.dtype == "object":  # foreach_get knows no strings
            return np.array([getattr(item, self.prop) for item in data], object)
        return foreach(data, self.prop, self.width, np.dtype(self.dtype).type)

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the values of those of the attributes that are there with this type and domain."""
        there = {a.name for a in obj.data.attributes if self._is_own_kind(a)}
        return {name: self.read(obj, name) for name in names if name in there}

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str:
        """Return `name`, or Blender's way of numbering it if something else bears it, or anything with `number`."""
        attributes = obj.data.attributes
        groups = {group.name for group in obj.vertex_groups}
        for candidate in numbered(name):
            taken = attributes.get(candidate)
            free = candidate not in groups if taken is None else self._is_own_kind(taken) and not number
            if free and candidate not in reserved:
                return candidate
        raise AssertionError("numbers do not end")

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the attribute or replace its values."""
        attributes = obj.data.attributes
        if name not in attributes:
            made = attributes.new(name, self.data_type, self.domain)
            if made is None:
                raise Refusal(f"'{obj.name}' cannot hold an attribute named '{name}': rename it on the source")
            name = made.name
        # fetched by name: up to Blender 5.0 references do not survive a new attribute
        data = attributes[name].data
        whole = covered.all()
        stored = values.astype(self.dtype, copy=not whole)
        if not whole:
            stored[~covered] = self.read(obj, name)[~covered]
        if self.dtype == "object":
            for item, value in zip(data, stored.tolist(), strict=True):
                setattr(item, self.prop, value)
        else:
            data.foreach_set(self.prop, stored.ravel())
        obj.data.update()

    def _is_own_kind(self, attribute: bpy.types.Attribute) -> bool:
        return attribute.data_type == self.data_type and attribute.domain == self.domain


def numbered(name: str) -> Iterator[str]:
    """Yield a name and then Blender's numbered forms of it."""
    yield name
    stem = name.encode()[:59].decode(errors="ignore")  # Blender cuts names to 63 bytes
    for number in count(1):
        yield f"{stem}.{number:03d}"
