"""Shape keys: displacements from the basis, with the slider, the relative key and the driver of each."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...solver.mesh import Booleans, Floats
from ..mesh_data import foreach, is_mirrored
from .access import Layer, numbered
from .carrier import Values


@dataclass(frozen=True, eq=False)
class Slider:
    """What a shape key has beside its shape."""

    value: float
    slider_min: float
    slider_max: float
    mute: bool
    interpolation: str
    vertex_group: str
    relative: str
    driver: bpy.types.FCurve | None


class ShapeKeyAccess:
    """Shape keys as displacements from the first key, in the space of `Surface` (x negated on a mirrored object)."""

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read every key but the first, each after the key that it is relative to."""
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
            yield Layer(key.name, _mirrored(obj, _shape(key) - _shape(basis)), _slider(keys, key))

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str | None:
        """Return `name`, another one if the target's first key bears it, or None if a locked key does."""
        keys = obj.data.shape_keys
        if keys is None:
            return name if name != "Basis" else next(x for x in numbered(name) if x != name)
        taken = keys.key_blocks.get(name)
        if taken is None:
            return name
        if taken == keys.reference_key:
            return next(x for x in numbered(name) if x not in keys.key_blocks and x not in reserved)
        return None if taken.lock_shape else name

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
        shape[covered] = (_shape(basis) + _mirrored(obj, values))[covered]
        key.points.foreach_set("co", shape.astype(np.float32).ravel())
        # the range first: a value is cut to it; a wide one first, since neither end may pass the other
        key.slider_min, key.slider_max = -10, 10
        key.slider_min, key.slider_max = about.slider_min, about.slider_max
        key.value, key.mute, key.interpolation = about.value, about.mute, about.interpolation
        key.vertex_group = about.vertex_group
        key.relative_key = keys.key_blocks.get(about.relative) or basis
        if about.driver is not None:
            path = f'key_blocks["{bpy.utils.escape_identifier(name)}"].value'
            key.driver_remove("value")
            copied = keys.animation_data_create().drivers.from_existing(src_driver=about.driver)
            copied.data_path = path
        obj.data.update()


def _keys(obj: bpy.types.Object) -> bpy.types.Key:
    keys = obj.data.shape_keys
    assert keys is not None
    return keys


def _shape(key: bpy.types.ShapeKey) -> Floats:
    return foreach(key.points, "co", 3, np.float32).astype(np.float64)


def _mirrored(obj: bpy.types.Object, vectors: Values) -> Floats:
    return np.asarray(vectors * np.array([-1.0 if is_mirrored(obj) else 1.0, 1.0, 1.0]), dtype=np.float64)


def _slider(keys: bpy.types.Key, key: bpy.types.ShapeKey) -> Slider:
    path = f'key_blocks["{bpy.utils.escape_identifier(key.name)}"].value'
    drivers = keys.animation_data.drivers if keys.animation_data else ()
    return Slider(
        value=key.value,
        slider_min=key.slider_min,
        slider_max=key.slider_max,
        mute=key.mute,
        interpolation=key.interpolation,
        vertex_group=key.vertex_group,
        relative=key.relative_key.name,
        driver=next((curve for curve in drivers if curve.data_path == path), None),
    )
