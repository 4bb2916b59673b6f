"""Material slots: which face has which material, whatever the slots' order on either object."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Booleans
from ..mesh_data import foreach
from .access import Layer
from .carrier import Values


class MaterialAccess:
    """The material slot of each polygon; slots whose material the target does not have are added to it."""

    domain = "FACE"

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the one name that stands for all slots, if there is any."""
        return ["Materials"] if len(obj.material_slots) else []

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the slots, if there are any, as one layer."""
        slots = [_key(slot.material) for slot in obj.material_slots]
        if slots:
            index = foreach(obj.data.polygons, "material_index", 1, np.int32)
            yield Layer("Materials", np.minimum(index, len(slots) - 1), slots)

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str:
        """Return `name`: slots have no name to collide."""
        return name

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the material of each polygon, as `describe` does, if the object has any."""
        slots = [_key(slot.material) for slot in obj.material_slots]
        if not any(slots):
            return {}
        index = foreach(obj.data.polygons, "material_index", 1, np.int32)
        return dict.fromkeys(names, self.describe(np.minimum(index, len(slots) - 1), slots))

    @staticmethod
    def describe(values: Values, slots: Sequence[Any]) -> Values:
        """Return the material of each polygon, (p,) texts, from its slot."""
        return np.array([repr(slot) for slot in slots], object)[values]

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Add the materials that are used and missing, and set the slot of each polygon."""
        slots = [_key(slot.material) for slot in obj.material_slots]
        slot_of = np.zeros(len(about), np.int32)
        for number in np.unique(values[covered]).tolist():
            if about[number] not in slots:
                key = about[number]
                obj.data.materials.append(None if key is None else bpy.data.materials.get(key))
                slots.append(about[number])
            slot_of[number] = slots.index(about[number])
        stored = slot_of[values]
        stored[~covered] = foreach(obj.data.polygons, "material_index", 1, np.int32)[~covered]
        obj.data.polygons.foreach_set("material_index", stored)
        obj.data.update()


def _key(material: bpy.types.Material | None) -> tuple[str, str | None] | None:
    """Return how to find a material again, if nobody has removed it in the meantime; None for an empty slot."""
    return None if material is None else (material.name, material.library.filepath if material.library else None)
