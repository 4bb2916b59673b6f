"""What a person can choose about a transfer: which layers, which parts, how they join what is there."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import corner_values, everything, make_sheet, positions, weights
from test_attributes import correspondence, flat

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Mask, Transfer, TransferSettings  # noqa: E402
from mobius_extension.mobius_addon.attributes.vertex_groups import read_weights  # noqa: E402
from mobius_extension.mobius_addon.attributes.weights import tidied  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, read_surface  # noqa: E402
from mobius_extension.mobius_addon.operators.transfer import read_through  # noqa: E402

N = 9


@pytest.fixture
def sheets() -> tuple[Any, Any]:
    return make_sheet("Source", N, flat), make_sheet("Target", N, flat)


def carry(source: Any, target: Any, bare: Any = slice(0), **choices: Any) -> Transfer:
    """Carry between flat sheets of the same place; target vertices `bare` correspond to nothing with certainty.

    In place of what has the same name, if nothing else is said.
    """
    found = correspondence(source, positions(target))
    found.matched[bare] = False
    surfaces = read_surface(source), read_surface(target)
    plan = read_through(
        source, target, surfaces, found, TransferSettings(**{"collisions": "replace"} | choices)
    ).carry()
    plan.write(target)
    return plan


def add_group(obj: Any, name: str, values: Any) -> None:
    group = obj.vertex_groups.new(name=name)
    for index, weight in enumerate(np.broadcast_to(values, len(obj.data.vertices)).tolist()):
        if weight > 0:
            group.add((index,), weight, "REPLACE")


def add_color(obj: Any, name: str, color: Any) -> None:
    layer = obj.data.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.broadcast_to(color, (len(layer.data), 4)).astype(np.float32).ravel())


def color(obj: Any, name: str) -> np.ndarray:
    return np.array([x.color[:] for x in obj.data.color_attributes[name].data])


def x_of(obj: Any) -> np.ndarray:
    return positions(obj)[:, 0]


# reading


def test_weights_are_read_as_they_are_also_beside_an_attribute_of_the_name_and_a_locked_shape(sheets: Any) -> None:
    source, _ = sheets
    rng = np.random.default_rng(0)
    given = np.where(rng.random((N * N, 3)) < 0.5, rng.random((N * N, 3)), 0).astype(np.float32)
    source.data.attributes.new("B", "FLOAT", "POINT")
    for name, column in zip("ABC", given.T, strict=True):
        add_group(source, name, column)
    source.shape_key_add(name="Basis")
    source.shape_key_add(name="Key").value = 1
    before = len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.node_groups)
    assert (read_weights(source, ["C", "A", "B"]) == given[:, [2, 0, 1]]).all()
    assert (len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.node_groups)) == before
    assert read_weights(source, []).shape == (N * N, 0)


# which layers


def test_layers_by_name_and_the_active_ones(sheets: Any) -> None:
    source, target = sheets
    for name in ("Jaw", "Eye.L", "Eye.R"):
        add_group(source, name, 0.5)
        source.data.uv_layers.new(name=f"UV {name}")
    add_color(source, "Jaw Paint", (1, 0, 0, 1))
    plan = carry(source, target, layers="named", names=("*Eye.?", "Jaw P*"))
    assert plan.counts() == {"vertex-groups": 2, "colors": 1, "uv": 2}
    source.vertex_groups.active = source.vertex_groups["Jaw"]
    source.data.uv_layers.active = source.data.uv_layers["UV Eye.L"]
    plan = carry(source, target, layers="active", kinds=("vertex-groups", "uv"))
    assert [x.source_name for x in plan.layers] == ["Jaw", "UV Eye.L"]
    with pytest.raises(Refusal, match="'Source' has no so named vertex groups to transfer"):
        carry(source, target, kinds=("vertex-groups",), layers="named", names=("Nose",))


def test_chosen_shape_keys_alone(sheets: Any) -> None:
    source, target = sheets
    for name in ("Basis", "Smile", "Frown"):
        source.shape_key_add(name=name)
    source.active_shape_key_index = 2
    carry(source, target, kinds=("shape-keys",), layers="active")
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Frown"]
    carry(source, target, kinds=("shape-keys",), layers="named", names=("Sm*",))
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Frown", "Smile"]


def test_groups_of_deforming_bones_alone(sheets: Any) -> None:
    source, target = sheets
    for name in ("Head", "Control", "Other"):
        add_group(source, name, 0.5)
    with pytest.raises(Refusal, match="Neither 'Source' nor 'Target' has an armature with deforming bones"):
        carry(source, target, kinds=("vertex-groups",), deform_only=True)
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("Head", "Control"):
        armature.data.edit_bones.new(name).tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data.bones["Control"].use_deform = False
    target.modifiers.new("Rig", "ARMATURE").object = armature
    plan = carry(source, target, kinds=("vertex-groups",), deform_only=True)
    assert [x.name for x in plan.layers] == ["Head"]


# how values join


@pytest.mark.parametrize(("mix", "expected"), [("replace", 0.5), ("add", 0.75), ("subtract", 0.0), ("multiply", 0.125)])
@pytest.mark.parametrize("factor", [1.0, 0.5])
def test_weights_and_colors_mix(sheets: Any, mix: str, expected: float, factor: float) -> None:
    source, target = sheets
    for obj, value in ((source, 0.5), (target, 0.25)):
        add_group(obj, "Head", value)
        add_color(obj, "Paint", [value] * 4)
    carry(source, target, mix=mix, mix_factor=factor)
    result = 0.25 + factor * ((-0.25 if mix == "subtract" else expected) - 0.25)
    assert weights(target, "Head") == pytest.approx(max(result, 0.0), abs=1e-6)
    assert color(target, "Paint") == pytest.approx(result)


def test_half_of_a_new_group_is_half_of_its_weights(sheets: Any) -> None:
    source, target = sheets
    add_group(source, "Head", 0.5)
    carry(source, target, mix_factor=0.5)
    assert weights(target, "Head") == pytest.approx(0.25)


def test_small_weights_are_left_out_the_strongest_kept_and_their_sum_made_one() -> None:
    rng = np.random.default_rng(3)
    given = rng.dirichlet(np.full(6, 0.3), 200)
    receives = np.arange(200) % 5 > 0
    tidy = tidied(given, receives, smallest=0.01, limit=3, normalize=True)
    assert (tidy[~receives] == given[~receives]).all()
    tidy, given = tidy[receives], given[receives]
    assert ((tidy > 0).sum(axis=1) <= 3).all()
    assert np.abs(tidy.sum(axis=1) - 1).max() < 1e-12
    for row, old in zip(tidy, given, strict=True):
        kept = [k for k in np.argsort(-old)[:3] if old[k] >= 0.01]
        assert sorted(np.flatnonzero(row)) == sorted(kept)
        assert row[kept] == pytest.approx(old[kept] / old[kept].sum())
    alone = tidied(given, np.ones(len(given), bool), smallest=0, limit=0, normalize=False)
    assert (alone == given).all()


def test_normalized_weights_leave_room_for_a_locked_group(sheets: Any) -> None:
    source, target = sheets
    for name in ("A", "B", "Locked"):
        add_group(source, name, 0.5)
    add_group(target, "Locked", 0.6)
    target.vertex_groups["Locked"].lock_weight = True
    carry(source, target, normalize=True)
    assert weights(target, "A") == pytest.approx(0.2)
    assert weights(target, "B") == pytest.approx(0.2)
    assert weights(target, "Locked") == pytest.approx(0.6)


def test_limit_and_smallest_weight_arrive(sheets: Any) -> None:
    source, target = sheets
    for name, value in (("A", 0.6), ("B", 0.3), ("C", 0.1), ("D", 0.00005)):
        add_group(source, name, value)
    carry(source, target)
    assert weights(target, "D").max() == 0
    carry(source, target, limit=2)
    assert [weights(target, name).max() > 0 for name in "ABCD"] == [True, True, False, False]
    assert [group.name for group in target.vertex_groups] == list("ABCD")


# masks


def test_a_target_mask_mixes_what_can_be_mixed_and_halves_what_cannot(sheets: Any) -> None:
    source, target = sheets
    ramp = (x_of(target) + 1) / 2
    add_group(target, "Mask", ramp)
    add_group(source, "Head", 1.0)
    add_group(target, "Head", 0.5)
    for obj, number in ((source, 3), (target, 8)):
        obj.data.attributes.new("Number", "INT", "POINT").data.foreach_set("value", np.full(N * N, number, np.int32))
        obj.data.attributes.new("Side", "INT", "FACE").data.foreach_set(
            "value", np.full((N - 1) ** 2, number, np.int32)
        )
    carry(source, target, target_mask=Mask("named", "Mask"), layers="named", names=("Head", "Number", "Side"))
    assert weights(target, "Head") == pytest.approx(0.5 + 0.5 * ramp, abs=1e-6)
    assert [x.value for x in target.data.attributes["Number"].data] == np.where(ramp >= 0.5, 3, 8).tolist()
    middle = np.array([polygon.center[0] for polygon in target.data.polygons])
    assert [x.value for x in target.data.attributes["Side"].data] == np.where(middle >= 0, 3, 8).tolist()
    add_group(target, "Other", 0.5)
    add_group(source, "Other", 1.0)
    inverted = Mask("named", "Mask", invert=True)
    carry(source, target, target_mask=inverted, layers="named", names=("Other",))
    assert weights(target, "Other") == pytest.approx(1 - 0.5 * ramp, abs=1e-6)


@pytest.mark.parametrize("by", ["group", "float", "boolean", "face", "selection"])
@pytest.mark.parametrize("invert", [False, True])
def test_a_source_mask_is_what_gives(sheets: Any, by: str, invert: bool) -> None:
    source, target = sheets
    add_group(source, "Head", 1.0)
    add_group(target, "Head", 0.25)
    right = x_of(source) > 0.1
    mask = Mask("named", "Mask", invert)
    if by == "group":
        add_group(source, "Mask", right.astype(float))
    elif by == "float":
        source.data.attributes.new("Mask", "FLOAT", "POINT").data.foreach_set("value", right.astype(np.float32))
    elif by == "boolean":
        source.data.attributes.new("Mask", "BOOLEAN", "POINT").data.foreach_set("value", right)
    elif by == "face":
        values = np.array([polygon.center[0] > 0.1 for polygon in source.data.polygons])
        source.data.attributes.new("Mask", "BOOLEAN", "FACE").data.foreach_set("value", values)
    else:
        source.data.vertices.foreach_set("select", right)
        mask = Mask("selected", invert=invert)
    plan = carry(source, target, source_mask=mask, layers="named", names=("Head",))
    given = ~right if invert else right
    if by == "face":  # at the border half of the faces around a vertex count
        given = (x_of(source) <= 0.1) if invert else (x_of(source) >= 0.1)
        border = np.abs(x_of(source)) < 0.3
        assert weights(target, "Head")[~border] == pytest.approx(np.where(given, 1.0, 0.25)[~border])
        return
    assert weights(target, "Head") == pytest.approx(np.where(given, 1.0, 0.25))
    assert f"{(~given).sum()} vertices of 'Target' have no counterpart and are left as they were" in plan.warnings


def test_a_mask_that_is_not_there_or_takes_all_is_refused(sheets: Any) -> None:
    source, target = sheets
    add_group(source, "Head", 1.0)
    before = everything(target)
    with pytest.raises(Refusal, match="'Source' has no vertex group and no attribute of single numbers named 'Hat'"):
        carry(source, target, source_mask=Mask("named", "Hat"))
    target.data.vertices.foreach_set("select", np.zeros(N * N, bool))
    with pytest.raises(Refusal, match="The mask of 'Target' excludes every vertex"):
        carry(source, target, target_mask=Mask("selected"))
    assert everything(target)["groups"] == before["groups"]


# what is unmatched


def hole(obj: Any) -> np.ndarray:
    return np.abs(positions(obj)[:, :2]).max(axis=1) < 0.6


@pytest.mark.parametrize("unmatched", ["carry", "leave", "nearest", "fill"])
def test_unmatched_vertices_get_what_is_chosen(sheets: Any, unmatched: str) -> None:
    source, target = sheets
    ramp = (x_of(source) + 1) / 2
    bare = hole(target)
    # what the map brings into the hole is nonsense
    add_group(source, "Head", np.where(bare, 0.0, ramp))
    add_group(target, "Head", 0.125)
    source.data.attributes.new("Number", "INT", "POINT").data.foreach_set(
        "value", np.where(bare, -1, 4).astype(np.int32)
    )
    plan = carry(source, target, bare=bare, unmatched=unmatched)
    arrived = weights(target, "Head")
    number = np.array([x.value for x in target.data.attributes["Number"].data])
    assert arrived[~bare] == pytest.approx(ramp[~bare], abs=1e-6)
    assert (plan.unmatched.vertices, plan.unmatched.outcome) == (bare.sum(), unmatched)
    assert plan.unmatched.area == pytest.approx(bare.sum() / 64)
    if unmatched == "carry":
        assert (arrived[bare] == 0).all()
        assert plan.warnings == ()
        assert plan.unmatched.remark() == f", {plan.unmatched.area:.1%} of its area uncertain"
        return
    assert len(plan.warnings) == 1
    assert plan.warnings[0].startswith(f"{bare.sum()} vertices of 'Target' ({plan.unmatched.area:.1%} of its area) ")
    if unmatched == "leave":
        assert (arrived[bare] == 0.125).all()
        assert (number[bare] == 0).all()
    else:
        assert (number == 4).all()
    if unmatched == "fill":
        assert arrived == pytest.approx(ramp, abs=1e-5)
    if unmatched == "nearest":
        assert np.isin(arrived[bare].round(5), ramp[~bare].astype(np.float32).round(5)).all()


@pytest.mark.parametrize("unmatched", ["nearest", "fill"])
def test_colors_of_corners_faces_and_uv_maps_in_a_gap(sheets: Any, unmatched: str) -> None:
    source, target = sheets
    bare = hole(target)
    source.data.uv_layers.new(name="UV")
    vertex = read_surface(source).corner_vertex
    plane = positions(source)[vertex, :2]
    source.data.uv_layers["UV"].uv.foreach_set("vector", np.where(bare[vertex, None], 99.0, plane).ravel())
    faces = (N - 1) ** 2
    inside = np.bincount(read_surface(source).corner_polygon, bare[vertex]) > 0
    source.data.attributes.new("Side", "INT", "FACE").data.foreach_set(
        "value", np.where(inside, -1, 4).astype(np.int32)
    )
    plan = carry(source, target, bare=bare, unmatched=unmatched)
    assert plan.counts() == {"uv": 1, "attributes": 1}
    side = np.array([x.value for x in target.data.attributes["Side"].data])
    assert side.shape == (faces,)
    assert (side == 4).all()
    uv = corner_values(target, "UV")
    if unmatched == "fill":
        assert uv == pytest.approx(plane, abs=1e-4)
    else:
        assert np.abs(uv).max() <= 1 + 1e-6


def test_a_shape_goes_smoothly_over_a_gap_in_the_target_s_own_space() -> None:
    source, target = make_sheet("Source", N, flat), make_sheet("Target", N, flat)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = correspondence(source, positions(target))
    target.data.vertices.foreach_set("co", (2 * positions(target) @ turn.T).astype(np.float32).ravel())
    source.shape_key_add(name="Basis")
    key = source.shape_key_add(name="Shift")
    key.points.foreach_set("co", (positions(source) + np.array([0.5, 0, 0])).astype(np.float32).ravel())
    found.matched[:] = ~hole(source)
    surfaces = read_surface(source), read_surface(target)
    for unmatched in ("fill", "nearest"):
        read_through(source, target, surfaces, found, TransferSettings(unmatched=unmatched)).carry().write(target)
        arrived = np.array([x.co[:] for x in target.data.shape_keys.key_blocks["Shift"].points]) - positions(target)
        assert np.abs(arrived - [0, 1, 0]).max() < 1e-5


def test_settings_out_of_range_are_sentences() -> None:
    with pytest.raises(ValueError, match="the mix factor lies from 0 to 1"):
        TransferSettings(mix_factor=1.5)
    with pytest.raises(ValueError, match="the smallest weight"):
        replace(TransferSettings(), smallest_weight=-0.1)
    with pytest.raises(ValueError, match="the limit"):
        TransferSettings(limit=-1)
