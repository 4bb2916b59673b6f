"""The correspondence as attributes, and node groups through which the target follows the source."""

from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, everything, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.attributes import LIVE_NAMES  # noqa: E402
from mobius_extension.mobius_addon.live import set_input  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.solver import interpolate  # noqa: E402


def evaluated(obj: Any, name: str, field: str, width: int) -> np.ndarray:
    bpy.context.view_layer.update()
    attribute = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes[name]
    values = np.empty(len(attribute.data) * width, np.float32)
    attribute.data.foreach_get(field, values)
    return values.reshape(-1, width)


@pytest.fixture
def aligned(pair: tuple[Any, Any]) -> tuple[Any, Any, Any]:
    bpy.ops.mobius.align(**QUICK)
    source, target = pair
    return source, target, stored_alignment.load(target, source, (read_surface(source), read_surface(target)))


def layer(source: Any, name: str, kind: str, field: str, width: int, domain: str = "POINT") -> np.ndarray:
    rng = np.random.default_rng(2)
    attribute = source.data.attributes.new(name, kind, domain)
    values = rng.uniform(0, 1, (len(attribute.data), width))
    if kind in ("INT", "BOOLEAN"):
        values = np.round(values * (9 if kind == "INT" else 1))
    source.data.attributes[name].data.foreach_set(field, values.astype(np.float32 if "F" in kind else int).ravel())
    source.data.update()
    return values


@pytest.mark.parametrize(
    ("kind", "field", "width"), [("FLOAT", "value", 1), ("FLOAT_VECTOR", "vector", 3), ("FLOAT_COLOR", "color", 4)]
)
def test_numbers_come_as_the_map_carries_them(aligned: Any, kind: str, field: str, width: int) -> None:
    source, target, found = aligned
    values = layer(source, "Some", kind, field, width)
    assert bpy.ops.mobius.live(attribute="Some") == {"FINISHED"}
    there = evaluated(target, "Some", field, width)
    assert np.abs(there - interpolate(found, values)).max() < 1e-5
    assert "Some" not in target.data.attributes


@pytest.mark.parametrize("kind", ["INT", "BOOLEAN"])
def test_others_come_from_the_corner_that_weighs_most(aligned: Any, kind: str) -> None:
    source, target, found = aligned
    values = layer(source, "Some", kind, "value", 1)
    bpy.ops.mobius.live(attribute="Some")
    largest = found.source_triangles[found.face, found.barycentric.argmax(axis=1)]
    clear = np.sort(found.barycentric, axis=1)[:, 2] - np.sort(found.barycentric, axis=1)[:, 1] > 1e-4
    assert (evaluated(target, "Some", "value", 1)[clear] == values[largest][clear]).all()


def test_the_target_follows_what_is_changed_later(aligned: Any) -> None:
    source, target, found = aligned
    before = everything(target)
    bpy.ops.ed.undo_push(message="aligned")
    bpy.ops.mobius.live("EXEC_DEFAULT", True, attribute="Right")
    right = (positions(source)[:, 0] + 1) / 2
    there = evaluated(target, "Right", "value", 1)[:, 0]
    assert np.abs(there - interpolate(found, right)).max() < 1e-5
    source.vertex_groups["Right"].add(range(len(source.data.vertices)), 0.25, "REPLACE")
    source.data.update()
    assert np.abs(evaluated(target, "Right", "value", 1) - 0.25).max() < 1e-5
    assert len(target.modifiers) == 1
    bpy.ops.mobius.live(attribute="Right")
    assert len(target.modifiers) == 1
    layer(source, "Other", "FLOAT", "value", 1)
    bpy.ops.mobius.live(attribute="Other")
    # a second attribute of one type shares the node group
    assert len(bpy.data.node_groups) == 1
    group = bpy.data.node_groups[0]
    assert group.asset_data is not None
    assert group.is_modifier
    bpy.ops.mobius.clear()
    assert not target.modifiers
    assert not [name for name in LIVE_NAMES if name in target.data.attributes]
    assert before["groups"]


def test_a_uv_map_stays_one(aligned: Any) -> None:
    source, target, found = aligned
    bpy.ops.mobius.live(attribute="UVMap")
    there = evaluated(target, "UVMap", "vector", 2)
    assert len(there) == len(target.data.loops)
    flat = positions(source)[:, :2] / 2 + 0.5
    expected = interpolate(found, flat)[[loop.vertex_index for loop in target.data.loops]]
    assert np.abs(there - expected).max() < 1e-5
    assert len(corner_values(source, "UVMap")) == len(source.data.loops)


def test_only_matched_vertices(aligned: Any) -> None:
    source, target, found = aligned
    layer(source, "Some", "FLOAT", "value", 1)
    bpy.ops.mobius.live(attribute="Some")
    set_input(target.modifiers[0], "Only Matched", True)
    target.update_tag()
    there = evaluated(target, "Some", "value", 1)[:, 0]
    assert not found.matched.all()
    assert (there[~found.matched] == 0).all()
    assert there[found.matched].any()


def test_what_cannot_be_followed_is_said(aligned: Any) -> None:
    source, target, _ = aligned
    before = everything(target)
    source.data.attributes.new("Words", "STRING", "POINT")
    for name, reason in (
        ("", "Choose an attribute"),
        ("None", "no attribute or vertex group 'None'"),
        ("Words", "cannot sample"),
    ):
        with pytest.raises(RuntimeError, match=reason):
            bpy.ops.mobius.live(attribute=name)
    assert everything(target) == before
    assert not bpy.data.node_groups


def test_two_meshes_do_not_follow_each_other(aligned: Any) -> None:
    source, target, _ = aligned
    target.vertex_groups.new(name="Own")
    assert bpy.ops.mobius.live(attribute="Right") == {"FINISHED"}
    assert bpy.ops.mobius.swap() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="'Target' follows 'Source' already"):
        bpy.ops.mobius.live(attribute="Own")
    assert not source.modifiers
    assert not [name for name in LIVE_NAMES if name in source.data.attributes]
    target.modifiers.clear()
    assert bpy.ops.mobius.live(attribute="Own") == {"FINISHED"}


def test_another_source_without_the_attribute_is_not_asked_for_it(aligned: Any) -> None:
    source, target, _ = aligned
    settings = bpy.context.scene.mobius
    layer(source, "Both", "FLOAT", "value", 1)
    layer(target, "Both", "FLOAT", "value", 1)
    settings.live_attribute = "Right"
    assert bpy.ops.mobius.swap() == {"FINISHED"}
    assert (settings.source, settings.live_attribute) == (target, "")
    settings.live_attribute = "Both"
    bpy.ops.mobius.swap()
    assert (settings.source, settings.live_attribute) == (source, "Both")
    settings.source = None  # while another is being chosen
    assert settings.live_attribute == "Both"
