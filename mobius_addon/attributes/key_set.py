"""An object's shape keys as a whole: relative or absolute, their time, and what moves their sliders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy

from .key_animation import carry_animation
from .shape_keys import Slider

STEP = 10.0
"""Frames between absolute keys, as Blender sets them."""


@dataclass(frozen=True)
class KeySet:
    """The keys of an object as they were read.

    Attributes
    ----------
    owner : (str, str or None)
        The object's name and its library, by which it is found again.
    names : tuple of str
        All but the first.
    relative : bool
        Whether sliders mix them; absolute ones follow each other in time.
    eval_time, first_frame, last_frame : float
        Where in time absolute keys are, and stand.
    """

    owner: tuple[str, str | None]
    names: tuple[str, ...]
    relative: bool
    eval_time: float
    first_frame: float
    last_frame: float


def key_set(obj: bpy.types.Object) -> KeySet | None:
    """Return what an object's keys are, None where it has none."""
    keys = obj.data.shape_keys
    if keys is None:
        return None
    frames = [key.frame for key in keys.key_blocks]
    owner = obj.name, obj.library.filepath if obj.library else None
    names = tuple(key.name for key in keys.key_blocks if key != keys.reference_key)
    return KeySet(owner, names, keys.use_relative, keys.eval_time, frames[0], max(frames))


@dataclass(frozen=True)
class KeyPlan:
    """What becomes of the target's keys as a whole.

    Attributes
    ----------
    source : KeySet
    names : mapping of str to str
        The carried keys' names on the source and on the target.
    sliders : mapping of str to Slider
        By the names on the target.
    relative : bool
        What the target's keys shall be.
    in_time : bool
        Whether they take over the source's time, as absolute keys.
    halves : mapping of str to str
        Further names on the target, of keys of the source that have become two.
    """

    source: KeySet
    names: Mapping[str, str]
    sliders: Mapping[str, Slider]
    relative: bool
    in_time: bool
    halves: Mapping[str, str]

    def prepare(self, obj: bpy.types.Object) -> None:
        """Make the target's first key, and its keys relative or absolute, before keys are written."""
        if obj.data.shape_keys is None:
            obj.shape_key_add(name="Basis", from_mix=False)
            keys: Any = obj.data.shape_keys
            if self.in_time and abs(self.source.first_frame - keys.key_blocks[0].frame) > 1e-3:
                first = keys.key_blocks[0]
                first.name = "Mobius First"  # the next one stands where time is
                keys.use_relative, keys.eval_time = False, self.source.first_frame
                obj.shape_key_add(name="Basis", from_mix=False)
                obj.shape_key_remove(first)
        keys = obj.data.shape_keys
        keys.use_relative = self.relative

    def finish(self, obj: bpy.types.Object) -> None:
        """Do what needs all keys to be there: time, drivers and keyframes."""
        keys: Any = obj.data.shape_keys
        if self.in_time:
            keys.eval_time = self.source.eval_time
        source = bpy.data.objects.get(self.source.owner)
        if source is not None and source.type == "MESH" and source.data.shape_keys is not None:
            carry_animation(source, obj, self.names, time=self.in_time)
            if self.halves:
                carry_animation(source, obj, self.halves, time=False)


def planned(
    source: KeySet, there: KeySet | None, sliders: Sequence[tuple[str, str, Slider]], target: str
) -> tuple[KeyPlan, list[str]]:
    """Return what becomes of the target's keys as a whole, and sentences about what could not be taken over.

    Parameters
    ----------
    source, there : KeySet
        The keys of the source, and those of the target if it has any.
    sliders : sequence of (str, str, Slider)
        The carried keys: their names on the source and on the target, and what they are.
    target : str
        What messages call the target.
    """
    names: dict[str, str] = {}
    halves: dict[str, str] = {}
    for old, new, _ in sliders:
        (halves if old in names else names)[old] = new
    found = {new: slider for _, new, slider in sliders}
    own = [] if there is None else [name for name in there.names if name not in found]
    if not own or there is None:
        return KeyPlan(source, names, found, source.relative, not source.relative, halves), []
    if there.relative:
        if source.relative:
            return KeyPlan(source, names, found, True, False, halves), []
        still = {name: replace(slider, value=0.0, frame=None) for name, slider in found.items()}
        note = (
            f"the shape keys of '{source.owner[0]}' are absolute and those of '{target}' relative: the carried ones "
            "are relative there, at 0, and follow no time"
        )
        return KeyPlan(source, names, still, True, False, halves), [note]
    base = there.last_frame + STEP
    later = {name: replace(slider, frame=base + STEP * k) for k, (name, slider) in enumerate(found.items())}
    note = f"'{target}' has absolute shape keys of its own: the carried ones stand after them, from frame {base:g} on"
    return KeyPlan(source, names, later, False, False, halves), [note]
