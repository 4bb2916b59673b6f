"""Material slots: which face has which material, whatever the slots' order on either object."""

from __future__ import annotations

from collections.abc import Iterator, Set
from typing import Any

import bpy
import numpy as np

from ...solver.mesh import Booleans
from ..mesh_data import foreach
from .access import Layer
from .carrier import Values


class MaterialAccess:
    """The material slot of each polygon; slots whose material the target does not have are added to it."""

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read the slots, if there are any, as one layer."""
        slots = [slot.material for slot in obj.material_slots]
        if slots:
            index = foreach(obj.data.polygons, "material_index", 1, np.int32)
            yield Layer("Materials", np.minimum(index, len(slots) - 1), slots)

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str:
        """Return `name`: slots have no name to collide."""
        return name

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Add the materials that are used and missing, and set the slot of each polygon."""
        slots = [slot.material for slot in obj.material_slots]
        slot_of = np.zeros(len(about), np.int32)
        for number in np.unique(values[covered]).tolist():
            if about[number] not in slots:
                obj.data.materials.append(about[number])
                slots.append(about[number])
            slot_of[number] = slots.index(about[number])
        stored = slot_of[values]
        stored[~covered] = foreach(obj.data.polygons, "material_index", 1, np.int32)[~covered]
        obj.data.polygons.foreach_set("material_index", stored)
        obj.data.update()
