"""Shape keys: displacements from the basis, with the slider, the relative key and the driver of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Booleans, Floats
from ..mesh_data import foreach, mirrored
from .access import Layer, numbered
from .carrier import Values


@dataclass(frozen=True, eq=False)
class Slider:
    """What a shape key has beside its shape: `driver` is the object it was read from, its library and the data path."""

    value: float
    slider_min: float
    slider_max: float
    mute: bool
    interpolation: str
    vertex_group: str
    relative: str
    driver: tuple[str, str | None, str] | None


class ShapeKeyAccess:
    """Shape keys as displacements from the first key, in the space of `Surface` (x negated on a mirrored object)."""

    domain = "POINT"

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the chosen keys but for the first, each after the key that it is relative to."""
        keys = obj.data.shape_keys
        if keys is None:
            return
        basis = keys.reference_key
        waiting, told = [key for key in keys.key_blocks if key != basis], {basis.name}
        while waiting:
            # keys that are relative to each other have no order: as they stand
            key = next((key for key in waiting if key.relative_key.name in told), waiting[0])
            waiting.remove(key)
            told.add(key.name)
            if chosen(key.name):
                yield Layer(key.name, mirrored(obj, _shape(key) - _shape(basis)), _slider(obj, key))

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str | None:
        """Return `name`, another one if the target's first key bears it, or None if a locked key does.

        Another one too if any key bears it and `number` is asked for.
        """
        keys = obj.data.shape_keys
        if keys is None:
            return name if name != "Basis" else next(x for x in numbered(name) if x != name)
        taken = keys.key_blocks.get(name)
        if taken is None:
            return name
        if taken == keys.reference_key or number:
            return next(x for x in numbered(name) if x not in keys.key_blocks and x not in reserved)
        return None if taken.lock_shape else name

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the displacements of those of the keys that are there."""
        keys = obj.data.shape_keys
        blocks = {} if keys is None else {name: keys.key_blocks[name] for name in names if name in keys.key_blocks}
        return {name: mirrored(obj, _shape(key) - _shape(_keys(obj).reference_key)) for name, key in blocks.items()}

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the key or replace its shape and slider; a new one does not move vertices that are not covered."""
        if obj.data.shape_keys is None:
            obj.shape_key_add(name="Basis", from_mix=False)
        keys = _keys(obj)
        if name not in keys.key_blocks:
            key = obj.shape_key_add(name=name, from_mix=False)
            key.points.foreach_set("co", _shape(keys.reference_key).astype(np.float32).ravel())
        key, basis = keys.key_blocks[name], keys.reference_key
        shape = _shape(key)
        shape[covered] = (_shape(basis) + mirrored(obj, values))[covered]
        key.points.foreach_set("co", shape.astype(np.float32).ravel())
        # the range first: a value is cut to it; a wide one first, since neither end may pass the other
        key.slider_min, key.slider_max = -10, 10
        key.slider_min, key.slider_max = about.slider_min, about.slider_max
        key.value, key.mute, key.interpolation = about.value, about.mute, about.interpolation
        key.vertex_group = about.vertex_group
        key.relative_key = keys.key_blocks.get(about.relative) or basis
        driver = None if about.driver is None else _driver(about.driver)
        if driver is not None:
            key.driver_remove("value")
            copied = keys.animation_data_create().drivers.from_existing(src_driver=driver)
            copied.data_path = _path(name)
        obj.data.update()


def _keys(obj: bpy.types.Object) -> bpy.types.Key:
    keys = obj.data.shape_keys
    assert keys is not None
    return keys


def _shape(key: bpy.types.ShapeKey) -> Floats:
    return foreach(key.points, "co", 3, np.float32).astype(np.float64)


def _path(name: str) -> str:
    return f'key_blocks["{bpy.utils.escape_identifier(name)}"].value'


def _driver(origin: tuple[str, str | None, str]) -> bpy.types.FCurve | None:
    """Return a driver that was read; by name, since what it belongs to may have gone in the meantime."""
    name, library, path = origin
    obj: Any = bpy.data.objects.get((name, library))
    keys = None if obj is None or obj.type != "MESH" else obj.data.shape_keys
    drivers = keys.animation_data.drivers if keys is not None and keys.animation_data else ()
    return next((curve for curve in drivers if curve.data_path == path), None)


def _slider(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> Slider:
    origin = (obj.name, obj.library.filepath if obj.library else None, _path(key.name))
    return Slider(
        value=key.value,
        slider_min=key.slider_min,
        slider_max=key.slider_max,
        mute=key.mute,
        interpolation=key.interpolation,
        vertex_group=key.vertex_group,
        relative=key.relative_key.name,
        driver=origin if _driver(origin) is not None else None,
    )
