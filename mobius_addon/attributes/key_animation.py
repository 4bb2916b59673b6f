"""What moves the sliders of shape keys: drivers, which are made to follow the new mesh, and keyframes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

import bpy

TIME = "eval_time"
"""What moves absolute keys."""

_KEY = re.compile(r'key_blocks\[(?:"((?:[^"\\]|\\.)*)"|(\d+))\]')
_OBJECT = re.compile(r'\bobjects\["((?:[^"\\]|\\.)*)"\]')


def carry_animation(
    source: bpy.types.Object, target: bpy.types.Object, names: Mapping[str, str], *, time: bool
) -> None:
    """Copy drivers and keyframes of carried keys, by their names on source and target, and those of `TIME` if asked.

    What drives a target's key of that name is replaced.
    """
    given, keys = source.data.shape_keys, target.data.shape_keys
    assert given is not None
    assert keys is not None
    for curve in list(given.animation_data.drivers) if given.animation_data else ():
        path = _renamed(curve.data_path, names, time)
        if path is None:
            continue
        keys.driver_remove(path)
        copied = keys.animation_data_create().drivers.from_existing(src_driver=curve)
        copied.data_path = path
        for variable in copied.driver.variables:
            for end in variable.targets:
                _follow(end, variable.type, source, target, names)
    own = _action(keys)
    if own is not None and not own.is_editable:  # of another file, which stays linked: `left_behind` says so
        return
    copies = [(curve, path) for curve in curves_of(given) if (path := _renamed(curve.data_path, names, time))]
    if copies and given != keys and not _same_curves(given, keys):
        bag = _bag(keys)
        for curve, path in copies:
            _copy_curve(curve, bag, path)


def left_behind(source: bpy.types.Object, target: bpy.types.Object, carried: Collection[str]) -> list[str]:
    """Return sentences about what moves the carried keys of a source and will not move those of the target."""
    keys = source.data.shape_keys
    if keys is None or keys.animation_data is None:
        return []
    names, found = {name: name for name in carried}, []
    for curve in keys.animation_data.drivers:
        if _renamed(curve.data_path, names, not keys.use_relative) is None:
            continue
        moved = _subject(curve.data_path)
        found += [
            f"the driver of {moved} follows {end.data_path} of '{source.name}', which '{target.name}' does not have: "
            f"it still follows '{source.name}'"
            for variable in curve.driver.variables
            for end in variable.targets
            if _is_about(end, variable.type, source) and _place(end, variable.type, source, target, names) is None
        ]
        named = {source.name, source.data.name, keys.name}
        if curve.driver.type == "SCRIPTED" and any(
            f"{q}{name}{q}" in curve.driver.expression for q in "'\"" for name in named
        ):
            found.append(f"the driver of {moved} names '{source.name}' in its expression: change it on '{target.name}'")
    stacked = {
        _subject(curve.data_path)
        for track in keys.animation_data.nla_tracks
        for strip in track.strips
        for curve in _curves_of_strip(strip)
        if _renamed(curve.data_path, names, not keys.use_relative) is not None
    }
    if stacked:
        found.append(
            f"strips of the nonlinear animation of '{source.name}' move {', '.join(sorted(stacked))}: they are not "
            f"carried, only the values that they have now"
        )
    action = None if target.data.shape_keys is None else _action(target.data.shape_keys)
    moved = [curve for curve in curves_of(keys) if _renamed(curve.data_path, names, not keys.use_relative) is not None]
    if moved and action is not None and not action.is_editable:
        found.append(f"the keyframes of '{target.name}' are linked from another file: those of keys are not carried")
    return found


def curves_of(data: bpy.types.ID) -> list[bpy.types.FCurve]:
    """Return the animation curves that move a data-block by its own action."""
    animated: Any = data.animation_data
    if animated is None or animated.action is None:
        return []
    return _curves(animated.action, getattr(animated, "action_slot", None))


def _curves_of_strip(strip: Any) -> Iterator[bpy.types.FCurve]:
    if strip.action is not None:
        yield from _curves(strip.action, getattr(strip, "action_slot", None))
    for inner in strip.strips if strip.type == "META" else ():
        yield from _curves_of_strip(inner)


def _curves(action: Any, slot: Any) -> list[bpy.types.FCurve]:
    """Return the curves of an action; from Blender 4.4 on, those of one of its slots."""
    if not hasattr(action, "layers"):
        return list(action.fcurves)
    if slot is None:
        return []
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips if strip.type == "KEYFRAME"]
    return [curve for bag in bags if bag is not None for curve in bag.fcurves]


def _action(data: bpy.types.ID) -> Any:
    return data.animation_data.action if data.animation_data else None


def _same_curves(first: bpy.types.ID, second: bpy.types.ID) -> bool:
    """Return whether two data-blocks are moved by the very same curves."""
    one, other = curves_of(first), curves_of(second)
    return bool(one) and bool(other) and one[0].as_pointer() == other[0].as_pointer()


def _bag(keys: Any) -> Any:
    """Return the curves that move a target's keys, to add to: of an action that nothing else uses.

    Another one uses it while `restored_on_failure` keeps a copy of the mesh.
    """
    animated = keys.animation_data_create()
    action = animated.action
    if action is None:
        animated.action = action = bpy.data.actions.new(f"{keys.name} Action")
    elif action.users - action.use_fake_user > 1:
        slot = getattr(animated, "action_slot", None)
        animated.action = action = action.copy()
        if slot is not None:
            animated.action_slot = action.slots[slot.identifier]
    if not hasattr(action, "layers"):
        return action.fcurves
    if animated.action_slot is None:
        animated.action_slot = action.slots.new(id_type="KEY", name=keys.name)
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(animated.action_slot, ensure=True).fcurves


def _copy_curve(curve: Any, bag: Any, path: str) -> None:
    """Add a copy of an animation curve under a data path, in place of the one that is there."""
    there = bag.find(path, index=curve.array_index)
    if there is not None:
        bag.remove(there)
    copied = bag.new(path, index=curve.array_index)
    _copy_values(curve, copied, ("extrapolation", "color_mode", "color", "lock", "mute", "hide", "auto_smoothing"))
    points = copied.keyframe_points
    if len(curve.keyframe_points):
        points.add(len(curve.keyframe_points))
        for point, new in zip(curve.keyframe_points, points, strict=True):
            _copy_values(point, new, _POINT)
    elif len(curve.sampled_points):  # samples of a baked curve become keyframes
        points.add(len(curve.sampled_points))
        for point, new in zip(curve.sampled_points, points, strict=True):
            new.co, new.interpolation = point.co, "LINEAR"
    for modifier in curve.modifiers:
        _copy_modifier(modifier, copied.modifiers.new(type=modifier.type))
    copied.update()


_POINT = ("co", "handle_left_type", "handle_right_type", "handle_left", "handle_right", "interpolation", "easing")
_POINT += ("back", "amplitude", "period", "type")


def _copy_modifier(modifier: Any, new: Any) -> None:
    # the form of a polynomial first: its coefficients have room then
    first = [name for name in ("mode", "poly_order") if hasattr(modifier, name)]
    rest = [x.identifier for x in modifier.bl_rna.properties if not x.is_readonly and x.type != "COLLECTION"]
    _copy_values(modifier, new, [*first, *(name for name in rest if name not in (*first, "active", "is_valid"))])
    if modifier.type == "ENVELOPE":
        for point in modifier.control_points:
            new.control_points.add(point.frame)
        # all at once: the setter of a single point reads beyond its memory (4.2 to 5.2), and may crash
        for end in ("min", "max"):
            ends = [getattr(point, end) for point in modifier.control_points]
            new.control_points.foreach_set(end, ends)


def _copy_values(given: Any, new: Any, names: Iterable[str]) -> None:
    for name in names:
        setattr(new, name, getattr(given, name))


def _renamed(path: str, names: Mapping[str, str], time: bool) -> str | None:
    """Return a data path of the source's keys as one of the target's, None where it is of no carried key."""
    if path == TIME:
        return path if time else None
    found = _KEY.match(path)
    name = names.get(bpy.utils.unescape_identifier(found[1])) if found and found[1] is not None else None
    if found is None or name is None:
        return None
    return f'key_blocks["{bpy.utils.escape_identifier(name)}"]{path[found.end() :]}'


def _subject(path: str) -> str:
    """Return what a data path of keys is about, as messages call it."""
    found = _KEY.match(path)
    return f"'{bpy.utils.unescape_identifier(found[1])}'" if found and found[1] else "the time of its keys"


def _is_about(end: Any, kind: str, source: bpy.types.Object) -> bool:
    """Return whether an end of a driver's variable is the source, its mesh or its keys."""
    if kind == "CONTEXT_PROP":
        return any(bpy.utils.unescape_identifier(name) == source.name for name in _OBJECT.findall(end.data_path))
    return end.id is not None and end.id in (source, source.data, source.data.shape_keys)


def _place(
    end: Any, kind: str, source: bpy.types.Object, target: bpy.types.Object, names: Mapping[str, str]
) -> str | None:
    """Return the data path by which the target has what an end of a variable takes from the source, None if nowhere."""
    path = end.data_path
    if kind == "CONTEXT_PROP":
        path = _OBJECT.sub(
            lambda found: (
                f'objects["{bpy.utils.escape_identifier(target.name)}"]'
                if bpy.utils.unescape_identifier(found[1]) == source.name
                else found[0]
            ),
            path,
        )
    elif kind != "SINGLE_PROP":  # a transform: every object has one
        return path
    found = _KEY.search(path)
    given, keys = source.data.shape_keys, target.data.shape_keys
    assert given is not None
    if found is not None:
        name = given.key_blocks[int(found[2])].name if found[2] else bpy.utils.unescape_identifier(found[1])
        if name not in names and (keys is None or name not in keys.key_blocks):
            return None
        own = bpy.utils.escape_identifier(names.get(name, name))
        return f'{path[: found.start()]}key_blocks["{own}"]{path[found.end() :]}'
    if path.endswith(TIME) or kind == "CONTEXT_PROP":
        return path
    try:
        {source: target, source.data: target.data, given: keys or target.data}[end.id].path_resolve(path)
    except ValueError:
        return None
    return path


def _follow(end: Any, kind: str, source: bpy.types.Object, target: bpy.types.Object, names: Mapping[str, str]) -> None:
    """Let an end of a copied driver's variable that is the source be the target, if that has what is followed."""
    if not _is_about(end, kind, source):
        return
    path = _place(end, kind, source, target, names)
    if path is None:
        return
    if kind != "CONTEXT_PROP":
        end.id = {source: target, source.data: target.data, source.data.shape_keys: target.data.shape_keys}[end.id]
    if path != end.data_path:
        end.data_path = path
