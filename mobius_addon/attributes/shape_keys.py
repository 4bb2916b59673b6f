"""Shape keys: how far each moves the key that it is relative to, with its slider and the group that limits it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Booleans, Floats
from ..mesh_data import foreach, mirrored
from .access import Layer, numbered
from .carrier import Values
from .vertex_groups import read_weights


@dataclass(frozen=True, eq=False)
class Slider:
    """What a shape key has beside its shape.

    Attributes
    ----------
    value, slider_min, slider_max, mute, interpolation
        As in `bpy.types.ShapeKey`.
    relative : str
        The key that it moves; "" stands for the first one. A key that moves itself shows nothing.
    vertex_group : str
        The group that limits the key, "" if there is none.
    limit : (n,) float32 or None
        The weights of that group.
    frame : float or None
        Where an absolute key stands; None for relative ones.
    """

    value: float
    slider_min: float
    slider_max: float
    mute: bool
    interpolation: str
    relative: str
    vertex_group: str
    limit: Values | None
    frame: float | None

    def renamed(self, keys: Mapping[str, str], groups: Mapping[str, str]) -> Slider:
        """Return the slider with the names that keys and groups, by their names on the source, have on the target."""
        return replace(self, relative=keys.get(self.relative, ""), vertex_group=groups.get(self.vertex_group, ""))


def limited(layer: Layer) -> Layer:
    """Return a key whose shape is what the group that limits it lets through, and that needs no group any more."""
    if layer.about.limit is None:
        return layer
    values = layer.values * layer.about.limit[:, None]
    return replace(layer, values=values, about=replace(layer.about, vertex_group="", limit=None))


class ShapeKeyAccess:
    """Shape keys as displacements in the space of `Surface` (x negated on a mirrored object).

    A relative key's are from the key that it is relative to, since these are what its slider adds; an absolute key's
    are from the first key.
    """

    domain = "POINT"

    def names(self, obj: bpy.types.Object) -> list[str]:
        """Return the names of all keys but the first."""
        keys = obj.data.shape_keys
        return [] if keys is None else [key.name for key in keys.key_blocks if key != keys.reference_key]

    def layers(self, obj: bpy.types.Object, chosen: Callable[[str], bool]) -> Iterator[Layer]:
        """Read the chosen keys but for the first, each after the key that it is relative to."""
        keys = obj.data.shape_keys
        if keys is None:
            return
        basis = keys.reference_key
        groups = sorted({key.vertex_group for key in keys.key_blocks} & set(obj.vertex_groups.keys()))
        weights = dict(zip(groups, read_weights(obj, groups).T, strict=True)) if keys.use_relative else {}
        waiting, told = [key for key in keys.key_blocks if key != basis], set()
        while waiting:
            moved = [key.relative_key for key in waiting]
            ready = (key for key, it in zip(waiting, moved, strict=True) if it not in waiting or it == key)
            key = next(ready, waiting[0])
            waiting.remove(key)
            if not chosen(key.name):
                continue
            told.add(key.name)
            about = _slider(key, keys)
            if keys.use_relative:
                # of keys that are relative to each other in a circle, one moves the first key by as much
                about = replace(
                    about,
                    relative=key.relative_key.name if key.relative_key.name in told else "",
                    vertex_group=key.vertex_group if key.vertex_group in weights else "",
                    limit=weights.get(key.vertex_group),
                )
            yield Layer(key.name, mirrored(obj, _displacement(key, keys)), about)

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str], *, number: bool = False) -> str | None:
        """Return `name`, another one if the target's first key bears it, or None if a locked key does.

        Another one too if any key bears it and `number` is asked for.
        """
        keys = obj.data.shape_keys
        there = {"Basis"} if keys is None else set(keys.key_blocks.keys())
        first = "Basis" if keys is None else keys.reference_key.name
        if name in there and name != first and not number:
            return None if keys is not None and keys.key_blocks[name].lock_shape else name
        return next(x for x in numbered(name) if x not in there and x not in reserved)

    def existing(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the displacements of those of the keys that are there, whatever limits them."""
        keys = obj.data.shape_keys
        there = () if keys is None else (keys.key_blocks[name] for name in names if name in keys.key_blocks)
        return {key.name: mirrored(obj, _displacement(key, _keys(obj))) for key in there}

    def shown(self, obj: bpy.types.Object, names: Sequence[str]) -> dict[str, Values]:
        """Return the displacements of those of the keys that are there, as far as the groups that limit them let."""
        found = self.existing(obj, names)
        return {name: _limit(obj, _keys(obj).key_blocks[name], moved) for name, moved in found.items()}

    def write(self, obj: bpy.types.Object, name: str, values: Values, covered: Booleans, about: Any = None) -> None:
        """Create the key or replace its shape and slider; a new one does not move vertices that are not covered.

        Other keys that are relative to it move what they moved before. A new key comes to stand at `about.frame` where
        the target's keys are absolute.
        """
        if obj.data.shape_keys is None:
            obj.shape_key_add(name="Basis", from_mix=False)
        keys = _keys(obj)
        key = keys.key_blocks.get(name)
        if key is not None and about.frame is not None and abs(key.frame - about.frame) > 1e-3:
            obj.shape_key_remove(key)  # the only way to another frame
            key = None
        before = None if key is None else _displacement(key, keys)
        if key is not None and before is not None and key.vertex_group != about.vertex_group:
            before = _limit(obj, key, before)
        key = _new_key(obj, name, about.frame) if key is None else key
        basis = keys.reference_key
        moved = keys.key_blocks.get(about.relative) or basis
        old = _shape(key)
        shape = _shape(basis if moved == key else moved)
        if before is not None:
            shape += np.where(covered[:, None], 0, before)
        shape[covered] += mirrored(obj, values)[covered]
        key.points.foreach_set("co", shape.astype(np.float32).ravel())
        key.relative_key = moved
        if before is not None and keys.use_relative:
            _shift(keys, key, _shape(key) - old)
        # the range first: a value is cut to it; a wide one first, since neither end may pass the other
        key.slider_min, key.slider_max = -10, 10
        key.slider_min, key.slider_max = about.slider_min, about.slider_max
        key.value, key.mute, key.interpolation = about.value, about.mute, about.interpolation
        key.vertex_group = about.vertex_group
        obj.data.update()


def _keys(obj: bpy.types.Object) -> bpy.types.Key:
    keys = obj.data.shape_keys
    assert keys is not None
    return keys


def _shape(key: bpy.types.ShapeKey) -> Floats:
    return foreach(key.points, "co", 3, np.float32).astype(np.float64)


def _displacement(key: bpy.types.ShapeKey, keys: bpy.types.Key) -> Floats:
    """Return how far a key moves the one that it is relative to, (n, 3), or the first one if that is itself."""
    moved = key.relative_key if keys.use_relative and key.relative_key != key else keys.reference_key
    return _shape(key) - _shape(moved)


def _limit(obj: bpy.types.Object, key: bpy.types.ShapeKey, moved: Floats) -> Floats:
    """Return what the group that limits a relative key lets through of its displacement."""
    if not _keys(obj).use_relative or key.vertex_group not in obj.vertex_groups:
        return moved
    return moved * read_weights(obj, [key.vertex_group])


def _new_key(obj: bpy.types.Object, name: str, frame: float | None) -> bpy.types.ShapeKey:
    keys = _keys(obj)
    if frame is not None:
        time, keys.eval_time = keys.eval_time, frame  # where Blender puts a new absolute key
        obj.shape_key_add(name=name, from_mix=False)
        keys.eval_time = time
    else:
        obj.shape_key_add(name=name, from_mix=False)
    key = keys.key_blocks[name]
    key.points.foreach_set("co", _shape(keys.reference_key).astype(np.float32).ravel())
    return key


def _shift(keys: bpy.types.Key, changed: bpy.types.ShapeKey, step: Floats) -> None:
    """Move the keys that are relative to a changed one along, and those that are relative to these."""
    if not step.any():
        return
    done, waiting = {changed.name}, [changed.name]
    while waiting:
        name = waiting.pop()
        for key in keys.key_blocks:
            if key.relative_key.name == name and key.name not in done and key != keys.reference_key:
                done.add(key.name)
                waiting.append(key.name)
                key.points.foreach_set("co", (_shape(key) + step).astype(np.float32).ravel())


def _slider(key: bpy.types.ShapeKey, keys: bpy.types.Key) -> Slider:
    return Slider(
        value=key.value,
        slider_min=key.slider_min,
        slider_max=key.slider_max,
        mute=key.mute,
        interpolation=key.interpolation,
        relative="",
        vertex_group="",
        limit=None,
        frame=None if keys.use_relative else key.frame,
    )
