"""Custom normals: unit vectors at face corners, turned with the surface."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Booleans, Floats
from ..mesh_data import foreach, mirrored
from .access import Layer
from .carrier import Values


class NormalAccess:
    """Custom normals in the space of `Surface` (x negated on a mirrored object).

    Blender keeps them as angles in each corner's own frame, of 16 bits, which is how exact they are; it marks edges as
    sharp where the normals on their sides differ.
    """

    domain = "CORNER"

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the one name that stands for custom normals, if there are any."""
        return ["Custom Normals"] if obj.data.has_custom_normals else []

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the normals, if the mesh has custom ones."""
        if obj.data.has_custom_normals:
            yield Layer("Custom Normals", mirrored(obj, _normals(obj)))

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str:
        """Return `name`: a mesh has custom normals once."""
        return name

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the custom normals, if the mesh has any."""
        return dict.fromkeys(names, mirrored(obj, _normals(obj))) if self.names(obj) else {}

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Set the normals; elsewhere they stay as they are seen now."""
        normals = np.where(covered[:, None], mirrored(obj, values), _normals(obj))
        obj.data.normals_split_custom_set(normals.astype(np.float32).tolist())


def _normals(obj: bpy.types.Object) -> Floats:
    return foreach(obj.data.corner_normals, "vector", 3, np.float32).astype(np.float64)
