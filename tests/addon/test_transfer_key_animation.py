"""What moves the sliders of carried shape keys: drivers that follow the new mesh, and keyframes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import make_object, make_sheet
from test_transfer_key_shapes import carry, key, sheets
from test_transfer_shape_keys import add_key

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import plan  # noqa: E402
from mobius_extension.mobius_addon.attributes.key_animation import curves_of  # noqa: E402


def drive(obj: Any, name: str, follows: Any, path: str, kind: str = "SINGLE_PROP", prop: str = "value") -> Any:
    """Let a property of a key follow one of a data-block, or a transform of an object; returns the variable."""
    driver = obj.data.shape_keys.key_blocks[name].driver_add(prop).driver
    variable = driver.variables.new()
    variable.type = kind
    end = variable.targets[0]
    if kind == "CONTEXT_PROP":
        end.context_property = "ACTIVE_SCENE"
    elif kind == "SINGLE_PROP":
        end.id_type = follows.id_type
    if follows is not None:
        end.id = follows
    if kind == "TRANSFORMS":
        end.transform_type = "LOC_X"
    else:
        end.data_path = path
    driver.expression = variable.name
    return variable


def end_of(obj: Any, name: str, prop: str = "value") -> Any:
    path = f'key_blocks["{name}"].{prop}'
    curve = next(x for x in obj.data.shape_keys.animation_data.drivers if x.data_path == path)
    return curve.driver.variables[0].targets[0]


def value(obj: Any, name: str) -> float:
    bpy.context.view_layer.update()
    return obj.data.shape_keys.key_blocks[name].value


@pytest.fixture
def two() -> tuple[Any, Any]:
    source, target = sheets()
    key(source, "Smile", 1, 0)
    key(source, "Corrective", 2, 0)
    return source, target


FOLLOWED = {
    "its own keys": (lambda obj: obj.data.shape_keys, 'key_blocks["Smile"].value', "SINGLE_PROP"),
    "its own keys by number": (lambda obj: obj.data.shape_keys, "key_blocks[1].value", "SINGLE_PROP"),
    "keys through the mesh": (lambda obj: obj.data, 'shape_keys.key_blocks["Smile"].value', "SINGLE_PROP"),
    "keys through the object": (lambda obj: obj, 'data.shape_keys.key_blocks["Smile"].value', "SINGLE_PROP"),
    "keys through the scene": (
        lambda obj: None,
        'objects["Source"].data.shape_keys.key_blocks["Smile"].value',
        "CONTEXT_PROP",
    ),
}


@pytest.mark.parametrize("what", FOLLOWED)
@pytest.mark.parametrize("named", ["Smile", "Smile.001"])
def test_a_driver_by_a_key_of_its_mesh_follows_that_of_the_new_mesh(two: Any, what: str, named: str) -> None:
    source, target = two
    if named != "Smile":
        key(target, "Smile", 7, 0)  # another one of the target's own
    followed, path, kind = FOLLOWED[what]
    drive(source, "Corrective", followed(source), path, kind)
    carry(source, target, "shape-keys")
    source.data.shape_keys.key_blocks["Smile"].value = 0.25
    target.data.shape_keys.key_blocks[named].value = 0.75
    assert value(target, "Corrective") == pytest.approx(0.75)
    assert value(source, "Corrective") == pytest.approx(0.25)
    if kind == "SINGLE_PROP":
        assert end_of(target, "Corrective").id == followed(target)
    else:
        assert 'objects["Target"]' in end_of(target, "Corrective").data_path


def test_a_driver_by_a_transform_of_the_source_follows_the_target_and_one_by_another_object_stays(two: Any) -> None:
    source, target = two
    rig = make_object("Rig", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    drive(source, "Smile", source, "", "TRANSFORMS")
    drive(source, "Corrective", rig, "", "TRANSFORMS")
    done = carry(source, target, "shape-keys")
    assert done.warnings == ()
    source.location.x, target.location.x, rig.location.x = 0.25, 0.5, 0.75
    assert value(target, "Smile") == pytest.approx(0.5)
    assert value(target, "Corrective") == pytest.approx(0.75)


def test_what_the_target_does_not_have_is_followed_on_the_source_and_said(two: Any) -> None:
    source, target = two
    source["control"] = 0.5
    drive(source, "Smile", source, '["control"]')
    drive(source, "Corrective", source.data.shape_keys, 'key_blocks["Smile"].value')
    done = carry(source, target, "shape-keys", layers="named", names=("Corrective",))
    assert done.warnings == (
        "the driver of 'Corrective' follows key_blocks[\"Smile\"].value of 'Source', which 'Target' does not have: "
        "it still follows 'Source'",
    )
    assert end_of(target, "Corrective").id == source.data.shape_keys
    done = carry(source, target, "shape-keys")
    assert done.warnings == (
        "the driver of 'Smile' follows [\"control\"] of 'Source', which 'Target' does not have: "
        "it still follows 'Source'",
    )
    assert end_of(target, "Smile").id == source
    assert end_of(target, "Corrective").id == target.data.shape_keys
    target["control"] = 0.125
    carry(source, target, "shape-keys")
    assert value(target, "Smile") == pytest.approx(0.125)
    assert len(target.data.shape_keys.animation_data.drivers) == 2


def test_an_expression_that_names_the_source_is_pointed_out(two: Any) -> None:
    source, target = two
    variable = drive(source, "Smile", source, "", "TRANSFORMS")
    driver = source.data.shape_keys.animation_data.drivers[0].driver
    driver.expression = f'{variable.name} + bpy.data.objects["Source"].location.y'
    done = carry(source, target, "shape-keys")
    assert done.warnings == ("the driver of 'Smile' names 'Source' in its expression: change it on 'Target'",)


def test_ranges_and_other_properties_of_a_key_keep_their_drivers(two: Any) -> None:
    source, target = two
    drive(source, "Smile", source, "", "TRANSFORMS", prop="slider_max")
    carry(source, target, "shape-keys")
    target.location.x = 0.5
    bpy.context.view_layer.update()
    assert target.data.shape_keys.key_blocks["Smile"].slider_max == pytest.approx(0.5)


# keyframes


def animate(obj: Any, name: str, points: dict[float, float]) -> Any:
    """Set keyframes of a slider and return their curve."""
    block = obj.data.shape_keys.key_blocks[name]
    block.slider_min, block.slider_max = -10, 10
    for frame, value in points.items():
        block.value = value
        block.keyframe_insert("value", frame=frame)
    return next(x for x in curves_of(obj.data.shape_keys) if x.data_path == f'key_blocks["{name}"].value')


def evaluated(obj: Any, name: str, frames: Any) -> list[float]:
    path = f'key_blocks["{name}"].value'
    curve = next(x for x in curves_of(obj.data.shape_keys) if x.data_path == path)
    return [curve.evaluate(frame) for frame in frames]


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=st.dictionaries(st.integers(0, 50), st.floats(-2, 2, width=16), min_size=1, max_size=6),
    interpolation=st.sampled_from(["CONSTANT", "LINEAR", "BEZIER", "BOUNCE", "ELASTIC", "BACK"]),
    handles=st.sampled_from(["FREE", "AUTO", "AUTO_CLAMPED", "VECTOR", "ALIGNED"]),
    easing=st.sampled_from(["AUTO", "EASE_IN", "EASE_OUT"]),
    extrapolation=st.sampled_from(["CONSTANT", "LINEAR"]),
    modifier=st.sampled_from([None, "CYCLES", "GENERATOR", "NOISE", "LIMITS", "STEPPED", "FNGENERATOR", "ENVELOPE"]),
    own=st.booleans(),
)
def test_keyframes_say_the_same_at_every_time(
    empty_scene: Any,
    points: dict[float, float],
    interpolation: str,
    handles: str,
    easing: str,
    extrapolation: str,
    modifier: str | None,
    own: bool,
) -> None:
    source, target = sheets()
    key(source, "Smile", 1)
    curve = animate(source, "Smile", points)
    curve.extrapolation = extrapolation
    for number, point in enumerate(curve.keyframe_points):
        point.interpolation, point.easing = interpolation, easing
        point.handle_left_type = point.handle_right_type = handles
        if handles == "FREE":
            point.handle_left = (point.co.x - 0.5 - 0.1 * number, point.co.y + 0.3)
            point.handle_right = (point.co.x + 0.4, point.co.y - 0.2)
        point.back, point.amplitude, point.period = 1.2, 0.3, 3.0
    if modifier:
        made = curve.modifiers.new(modifier)
        if modifier == "GENERATOR":
            made.poly_order = 2
            made.coefficients = (0.1, 0.5, -0.01)
        if modifier == "ENVELOPE":
            made.control_points.add(10)
            made.control_points.foreach_set("min", [-0.2])  # point.min = ... reads beyond the point's memory
            made.control_points.foreach_set("max", [0.7])
        if modifier == "LIMITS":
            made.use_max_y, made.max_y = True, 0.5
        made.use_influence, made.influence = True, 0.75
    curve.update()
    if own:
        key(target, "Own", 2)
        animate(target, "Own", {3: 0.0, 8: 1.0})
    for _ in range(2):
        carry(source, target, "shape-keys")
    frames = np.linspace(-20, 70, 181)
    assert evaluated(target, "Smile", frames) == pytest.approx(evaluated(source, "Smile", frames), abs=1e-5)
    assert len(curves_of(target.data.shape_keys)) == 1 + own
    if own:
        assert evaluated(target, "Own", [3, 8]) == [0, 1]


def test_only_what_is_carried_is_animated_and_what_another_mesh_uses_stays() -> None:
    source, target = sheets()
    for name in ("Smile", "Frown"):
        key(source, name, 1)
        animate(source, name, {1: 0, 10: 1})
    twin = make_sheet("Twin", 4)
    for obj in (target, twin):
        key(obj, "Own", 3)
    animate(twin, "Own", {1: 0, 10: 1})
    given = twin.data.shape_keys.animation_data
    shared = target.data.shape_keys.animation_data_create()
    shared.action = given.action
    if hasattr(shared, "action_slot"):
        shared.action_slot = given.action_slot
    carry(source, target, "shape-keys", layers="named", names=("Smile",))
    assert [x.data_path for x in curves_of(twin.data.shape_keys)] == ['key_blocks["Own"].value']
    assert sorted(x.data_path for x in curves_of(target.data.shape_keys)) == [
        'key_blocks["Own"].value',
        'key_blocks["Smile"].value',
    ]
    bpy.context.scene.frame_set(10)
    assert target.data.shape_keys.key_blocks["Smile"].value == pytest.approx(1)


def actions() -> list[tuple[str, int, bool]]:
    return sorted((x.name, x.users, x.use_fake_user) for x in bpy.data.actions)


@pytest.mark.parametrize("fake", [False, True])
def test_keyframes_join_the_target_s_own_action_which_a_failure_leaves_as_it_was(
    fake: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = sheets()
    for obj, name in ((source, "Smile"), (target, "Own")):
        key(obj, name, 1)
        animate(obj, name, {1: 0, 10: 1})
    own = target.data.shape_keys.animation_data.action
    own.name, own.use_fake_user = "Talking", fake
    before = actions()
    remember = plan.remember

    def fails(*_: Any) -> None:
        raise MemoryError("no memory")

    monkeypatch.setattr(plan, "remember", fails)
    with pytest.raises(MemoryError):
        carry(source, target, "shape-keys")
    assert actions() == before
    assert [x.data_path for x in curves_of(target.data.shape_keys)] == ['key_blocks["Own"].value']
    monkeypatch.setattr(plan, "remember", remember)
    for _ in range(2):
        carry(source, target, "shape-keys")
        assert actions() == before
        assert target.data.shape_keys.animation_data.action.name == "Talking"
        assert len(curves_of(target.data.shape_keys)) == 2


def test_the_value_follows_its_keyframes_under_another_name() -> None:
    source, target = sheets()
    key(source, 'A "B"', 1)
    key(target, 'A "B"', 2)
    block = source.data.shape_keys.key_blocks[1]
    for frame, at in ((1, 0.0), (11, 1.0)):
        block.value = at
        block.keyframe_insert("value", frame=frame)
    carry(source, target, "shape-keys")
    bpy.context.scene.frame_set(11)
    assert target.data.shape_keys.key_blocks['A "B".001'].value == pytest.approx(1)
    bpy.context.scene.frame_set(1)
    assert target.data.shape_keys.key_blocks['A "B".001'].value == pytest.approx(0)


def test_strips_of_the_nonlinear_animation_are_said() -> None:
    source, target = sheets()
    add_key(source, "Smile", np.full((16, 3), 0.1))
    animate(source, "Smile", {1: 0, 10: 1})
    animated = source.data.shape_keys.animation_data
    action, slot = animated.action, getattr(animated, "action_slot", None)
    animated.action = None
    strip = animated.nla_tracks.new().strips.new("Talk", 1, action)
    if slot is not None:
        strip.action_slot = slot
    done = carry(source, target, "shape-keys")
    assert done.warnings == (
        "strips of the nonlinear animation of 'Source' move 'Smile': they are not carried, only the values that they "
        "have now",
    )


def test_keyframes_of_another_file_stay_linked_and_it_is_said(two: Any, tmp_path: Path) -> None:
    source, target = two
    key(target, "Own", 3)
    animate(target, "Own", {1: 0.0, 9: 1.0})
    keys = target.data.shape_keys
    action = keys.animation_data.action
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {action})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (stored, wanted):
        wanted.actions = stored.actions
    keys.animation_data.action = wanted.actions[0]
    if hasattr(keys.animation_data, "action_slot"):
        keys.animation_data.action_slot = wanted.actions[0].slots[0]
    bpy.data.actions.remove(action)
    animate(source, "Smile", {1: 0.0, 5: 1.0})
    said = carry(source, target, "shape-keys").warnings
    assert any("linked from another file" in text for text in said)
    assert keys.animation_data.action == wanted.actions[0]
    assert evaluated(target, "Own", [9]) == [1.0]
