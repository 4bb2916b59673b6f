"""Shape keys keep what they show: whatever they are relative to, whatever limits them, relative or absolute."""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import make_sheet, positions, weights
from test_attributes import flat
from test_transfer_rules import add_group
from test_transfer_shape_keys import add_key, same_vertices, shape

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Mask, Transfer, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.operators.transfer import read_through  # noqa: E402

N = 4
COUNT = N * N


def sheets() -> tuple[Any, Any]:
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    return make_sheet("Source", N), make_sheet("Target", N)


def seen(obj: Any) -> np.ndarray:
    """How far shape keys move each vertex, as Blender shows it."""
    bpy.context.view_layer.update()
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([v.co[:] for v in shown.data.vertices]) - shape(obj, obj.data.shape_keys.reference_key.name)


def carry(source: Any, target: Any, *kinds: str, **choices: Any) -> Transfer:
    plan = plan_transfer(source, target, same_vertices(source, target), TransferSettings(kinds=kinds, **choices))
    plan.write(target)
    return plan


def move(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(COUNT, 3)) * 0.1


def key(obj: Any, name: str, seed: int, value: float = 1.0) -> Any:
    made = add_key(obj, name, move(seed))
    made.value = value
    return made


KEY = st.fixed_dictionaries(
    {
        "relative": st.integers(0, 4),
        "value": st.sampled_from([0.0, 0.25, 1.0, -0.5]),
        "mute": st.booleans(),
        "group": st.sampled_from(["", "Ramp", "Half", "absent"]),
        "carried": st.booleans(),
    }
)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    keys=st.lists(KEY, min_size=1, max_size=4),
    own=st.lists(KEY, max_size=2),
    groups=st.booleans(),
    collisions=st.sampled_from(["number", "replace"]),
    again=st.booleans(),
)
def test_what_carried_keys_show_on_the_source_they_show_on_the_target(
    empty_scene: Any, keys: list[dict[str, Any]], own: list[dict[str, Any]], groups: bool, collisions: str, again: bool
) -> None:
    """Any keys, relative to each other in any way, in circles too, limited by groups: their sum is seen again.

    Beside it, keys of the target's own show what they showed, those of equal name unless they are to be replaced.
    """
    source, target = sheets()
    for obj in (source, target):
        sign = 1 if obj == source else -1
        add_group(obj, "Ramp", (sign * positions(obj)[:, 0] + 1) / 2)
        add_group(obj, "Half", (sign * positions(obj)[:, 1] > 0).astype(float))
    for obj, wanted, first in ((source, keys, 0), (target, own, 50)):
        for number, how in enumerate(wanted):
            made = key(obj, f"K{number}", first + number)
            made.slider_min = -1
            made.value, made.mute = how["value"], how["mute"]
            made.vertex_group = how["group"]
        blocks = obj.data.shape_keys.key_blocks if wanted else []
        for number, how in enumerate(wanted):
            blocks[number + 1].relative_key = blocks[how["relative"] % len(blocks)]
    names = [f"K{number}" for number, how in enumerate(keys) if how["carried"]]
    if not names:
        return
    if collisions == "replace":
        for number in range(len(own)):
            if f"K{number}" in names:  # what will be replaced does not count
                target.data.shape_keys.key_blocks[f"K{number}"].value = 0
    before = seen(target) if own else np.zeros((COUNT, 3))
    for number, how in enumerate(keys):
        if not how["carried"]:
            source.data.shape_keys.key_blocks[f"K{number}"].mute = True
    expected = seen(source)
    kinds = ("shape-keys", "vertex-groups") if groups else ("shape-keys",)
    choices = {"layers": "named", "names": (*names, "Ramp", "Half"), "collisions": collisions}
    for _ in range(2 if again else 1):
        carry(source, target, *kinds, **choices)
    # replaced groups limit the target's own keys otherwise
    if not (groups and collisions == "replace" and any(how["group"] in ("Ramp", "Half") for how in own)):
        assert np.abs(seen(target) - before - expected).max() < 1e-5
    there = [x.name for x in (*target.data.shape_keys.key_blocks, *target.vertex_groups)]
    assert not any(name.endswith(".002") for name in there)
    assert {*(f"K{k}" for k in range(len(own))), *names} <= set(there)


@pytest.mark.parametrize("carried", [("Fix",), ("Smile", "Fix")])
def test_a_key_keeps_its_shape_whether_or_not_the_one_it_is_relative_to_comes_along(carried: tuple[str, ...]) -> None:
    source, target = sheets()
    smile, fix = key(source, "Smile", 1, 0), key(source, "Fix", 2, 1)
    fix.relative_key = smile
    shown = seen(source)
    carry(source, target, "shape-keys", layers="named", names=carried)
    assert np.abs(seen(target) - shown).max() < 1e-6
    relative = target.data.shape_keys.key_blocks["Fix"].relative_key.name
    assert relative == ("Smile" if "Smile" in carried else "Basis")


@pytest.mark.parametrize("kinds", [("shape-keys",), ("shape-keys", "vertex-groups")])
def test_a_limit_is_kept_by_the_group_or_in_the_shape(kinds: tuple[str, ...]) -> None:
    source, target = sheets()
    add_group(source, "Right", (positions(source)[:, 0] > 0).astype(float))
    add_group(target, "Right", 1.0)  # another one
    key(source, "Lift", 1).vertex_group = "Right"
    shown = seen(source)
    carry(source, target, *kinds)
    assert np.abs(seen(target) - shown).max() < 1e-6
    assert (weights(target, "Right") == 1).all()
    lift = target.data.shape_keys.key_blocks["Lift"]
    assert lift.vertex_group == ("Right.001" if len(kinds) == 2 else "")


def test_a_group_that_is_changed_on_its_way_is_no_limit_and_an_absent_one_none() -> None:
    source, target = sheets()
    for name in ("A", "B"):
        add_group(source, name, 0.25)
    key(source, "Lift", 1).vertex_group = "A"
    key(source, "Free", 2).vertex_group = "Gone"
    add_group(target, "Gone", 0.5)
    shown = seen(source)
    carry(source, target, "shape-keys", "vertex-groups", normalize=True)
    assert weights(target, "A") == pytest.approx(0.5)
    assert np.abs(seen(target) - shown).max() < 1e-6


def test_keys_of_the_target_that_are_relative_to_a_replaced_one_show_what_they_showed() -> None:
    source, target = sheets()
    key(source, "Smile", 1, 0)
    smile, fix, finer = (key(target, name, seed, 0) for name, seed in (("Smile", 2), ("Fix", 3), ("Finer", 4)))
    fix.relative_key, finer.relative_key = smile, fix
    fix.value = finer.value = 1
    shown = seen(target)
    carry(source, target, "shape-keys", collisions="replace")
    assert np.abs(shape(target, "Smile") - positions(target) - move(1)).max() < 1e-6
    target.data.shape_keys.key_blocks["Smile"].value = 0
    assert np.abs(seen(target) - shown).max() < 1e-6


def test_half_of_a_key_relative_to_one_that_is_there_is_half_of_what_it_shows() -> None:
    source, target = sheets()
    smile, fix = key(source, "Smile", 1, 0), key(source, "Fix", 2, 1)
    fix.relative_key = smile
    key(target, "Smile", 3, 0)
    shown = seen(source)
    carry(source, target, "shape-keys", mix_factor=0.5, layers="named", names=("Fix",))
    assert np.abs(seen(target) - shown / 2).max() < 1e-6


def test_a_masked_part_of_a_replaced_key_keeps_what_it_showed() -> None:
    source, target = sheets()
    key(source, "Smile", 1), key(target, "Smile", 2)
    half = positions(target)[:, 0] > 0
    add_group(target, "Mask", half.astype(float))
    found = same_vertices(source, target)
    choices = TransferSettings(kinds=("shape-keys",), target_mask=Mask("named", "Mask"))
    read_through(source, target, (found.source, found.target), found.correspondence, choices).carry().write(target)
    assert np.abs(seen(target) - np.where(half[:, None], move(1), move(2))).max() < 1e-6


# absolute keys


def absolute(obj: Any, frames: dict[str, float], seed: int = 0) -> Any:
    """Absolute keys at frames, the first of which is the shape at rest."""
    keys = None
    for number, (name, frame) in enumerate(frames.items()):
        if keys is None:
            obj.shape_key_add(name="Dummy", from_mix=False)
            keys = obj.data.shape_keys
            keys.use_relative = False
        keys.eval_time = frame
        made = obj.shape_key_add(name=name, from_mix=False)
        shapes = positions(obj) + (move(seed + number) if number else 0)
        made.points.foreach_set("co", shapes.astype(np.float32).ravel())
        if number == 0:
            obj.shape_key_remove(keys.key_blocks["Dummy"]) if frame else obj.shape_key_remove(made)
            keys.key_blocks[0].name = name
    return keys


def frames_of(obj: Any) -> dict[str, float]:
    return {block.name: round(block.frame, 2) for block in obj.data.shape_keys.key_blocks}


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    frames=st.lists(st.integers(1, 90), min_size=2, max_size=5, unique=True).map(sorted),
    rest=st.sampled_from([0, 0.5]),
    time=st.floats(0, 95, width=16),
    forms=st.lists(st.sampled_from(["KEY_LINEAR", "KEY_CARDINAL", "KEY_BSPLINE"]), min_size=6, max_size=6),
    again=st.booleans(),
)
def test_absolute_keys_follow_each_other_as_on_the_source(
    empty_scene: Any, frames: list[int], rest: float, time: float, forms: list[str], again: bool
) -> None:
    source, target = sheets()
    keys = absolute(source, {"Basis": rest} | {f"K{k}": frame for k, frame in enumerate(frames)})
    for block, form in zip(keys.key_blocks, forms, strict=False):
        block.interpolation = form
    for _ in range(2 if again else 1):
        plan = carry(source, target, "shape-keys")
        assert plan.warnings == ()
    copied = target.data.shape_keys
    assert not copied.use_relative
    assert frames_of(target) == frames_of(source)
    for at in (time, float(frames[0]), float(frames[-1])):
        keys.eval_time = copied.eval_time = at
        # the form of the first key is the target's own
        copied.reference_key.interpolation = keys.reference_key.interpolation
        assert np.abs(seen(target) - seen(source)).max() < 1e-5


def test_time_comes_along_with_absolute_keys() -> None:
    source, target = sheets()
    keys = absolute(source, {"Basis": 0, "A": 10, "B": 20})
    for frame in (1, 11):
        keys.eval_time = 2.0 * frame
        keys.keyframe_insert("eval_time", frame=frame)
    keys.eval_time = 15
    carry(source, target, "shape-keys")
    assert target.data.shape_keys.eval_time == pytest.approx(15)
    for frame, time in ((1, 2), (11, 22)):
        bpy.context.scene.frame_set(frame)
        assert target.data.shape_keys.eval_time == pytest.approx(time)


def test_absolute_keys_beside_relative_ones_are_carried_and_move_nothing() -> None:
    source, target = sheets()
    absolute(source, {"Basis": 0, "A": 10}).eval_time = 7
    key(target, "Own", 5, 0.5)
    shown = seen(target)
    plan = carry(source, target, "shape-keys")
    assert plan.warnings == (
        "the shape keys of 'Source' are absolute and those of 'Target' relative: the carried ones are relative there, "
        "at 0, and follow no time",
    )
    assert np.abs(seen(target) - shown).max() < 1e-6
    assert np.abs(shape(target, "A") - shape(source, "A")).max() < 1e-6


def test_relative_keys_beside_absolute_ones_come_after_them() -> None:
    source, target = sheets()
    key(source, "Smile", 1)
    keys = absolute(target, {"Basis": 0, "A": 10, "B": 20}, seed=8)
    shown = []
    for time in (0, 7, 20):
        keys.eval_time = time
        shown.append(seen(target))
    plan = carry(source, target, "shape-keys")
    assert plan.warnings == (
        "'Target' has absolute shape keys of its own: the carried ones stand after them, from frame 30 on",
    )
    assert frames_of(target) == {"Basis": 0, "A": 10, "B": 20, "Smile": 30}
    for time, before in zip((0, 7, 20), shown, strict=True):
        keys.eval_time = time
        assert np.abs(seen(target) - before).max() < 1e-6


def test_a_flat_sheet_with_a_key_at_rest_is_carried() -> None:
    source, target = make_sheet("Source", N, flat), make_sheet("Target", N, flat)
    source.shape_key_add(name="Basis")
    source.shape_key_add(name="Still")
    carry(source, target, "shape-keys")
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Still"]
