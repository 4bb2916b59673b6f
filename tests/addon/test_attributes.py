"""The table of attributes: read, carried, written; each type, and what stands in the way."""

from typing import Any

import numpy as np
import pytest
from scenes import corner_values, everything, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import (  # noqa: E402
    KINDS,
    ROWS,
    AttributeAccess,
    Carrier,
    Transfer,
    TransferSettings,
    plan_transfer,
)
from mobius_extension.mobius_addon.mesh_data import Refusal, read_surface  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402

ALL = [kind.identifier for kind in KINDS]
GENERAL_ROWS = [row for row in ROWS if isinstance(row.access, AttributeAccess) and not row.access.only]
KNOWN_TYPES = {item.identifier for item in bpy.types.Attribute.bl_rna.properties["data_type"].enum_items}
EVERY_ROW = [row for row in GENERAL_ROWS if row.access.data_type in KNOWN_TYPES]
ATTRIBUTE_ROWS = [
    row
    for row in EVERY_ROW
    if row.access.domain in ("POINT", "CORNER")
    and row.access.data_type in ("FLOAT", "FLOAT2", "FLOAT_VECTOR", "FLOAT4", "FLOAT_COLOR", "BYTE_COLOR")
]


def flat(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0 * x


def correspondence(source: Any, places: np.ndarray) -> Correspondence:
    """The correspondence of points (n, 2) with a flat sheet, found by testing every triangle."""
    surface = read_surface(source)
    vertices, faces = surface.mesh.vertices[:, :2], surface.mesh.faces
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    sides = np.stack([b - a, c - a], axis=2)
    uv = np.einsum("mij,qmj->qmi", np.linalg.inv(sides), places[:, None, :2] - a)
    all_three = np.concatenate([1 - uv.sum(axis=2, keepdims=True), uv], axis=2)
    face = all_three.min(axis=2).argmax(axis=1)
    barycentric = all_three[np.arange(len(places)), face].clip(0, 1)
    barycentric /= barycentric.sum(axis=1, keepdims=True)
    return Correspondence(
        face=face,
        barycentric=barycentric,
        matched=np.ones(len(places), bool),
        confidence=np.ones(len(places)),
        source_triangles=faces,
        source_size=len(vertices),
    )


def carrier(source: Any, target: Any, bare: slice = slice(0)) -> Carrier:
    """Carry between flat sheets of the same place; the vertices `bare` of the target have no counterpart."""
    found = correspondence(source, positions(target))
    found.face[bare] = -1
    found.barycentric[bare] = 0
    return Carrier(found, read_surface(source), read_surface(target))


def transfer(source: Any, target: Any, kinds: list[str] = ALL, bare: slice = slice(0)) -> Transfer:
    """Carry the kinds, in place of what has their names."""
    settings = TransferSettings(kinds=tuple(kinds), collisions="replace")
    plan = plan_transfer(source, target, carrier(source, target, bare), settings)
    plan.write(target)
    return plan


def fill(obj: Any, row: Any, name: str, values: np.ndarray) -> None:
    access = row.access
    obj.data.attributes.new(name, access.data_type, access.domain)
    obj.data.attributes[name].data.foreach_set(access.prop, values.astype(np.float32).ravel())


def values_of(obj: Any, row: Any, name: str) -> np.ndarray:
    data = obj.data.attributes[name].data
    values = np.empty(len(data) * row.access.width, np.float32)
    data.foreach_get(row.access.prop, values)
    return values.reshape(len(data), -1)


def element_positions(obj: Any, domain: str) -> np.ndarray:
    where = positions(obj)
    return where if domain == "POINT" else where[[loop.vertex_index for loop in obj.data.loops]]


@pytest.mark.parametrize("row", ATTRIBUTE_ROWS, ids=lambda row: f"{row.access.data_type}-{row.access.domain}")
def test_each_attribute_comes_back_from_itself_unchanged(row: Any) -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    rng = np.random.default_rng(1)
    count = len(element_positions(source, row.access.domain))
    per_vertex = rng.random((len(source.data.vertices), row.access.width))
    values = per_vertex if row.access.domain == "POINT" else per_vertex[read_surface(source).corner_vertex]
    fill(source, row, "Data", values)
    assert len(values) == count
    transfer(source, target, [row.kind])
    assert (values_of(target, row, "Data") == values_of(source, row, "Data")).all()


@pytest.mark.parametrize(
    "row",
    [row for row in ATTRIBUTE_ROWS if row.access.data_type != "BYTE_COLOR"],
    ids=lambda row: f"{row.access.data_type}-{row.access.domain}",
)
def test_a_linear_field_is_carried_exactly_between_triangulations_of_a_plane(row: Any) -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    matrix = np.random.default_rng(2).normal(size=(3, row.access.width))
    fill(source, row, "Data", element_positions(source, row.access.domain) @ matrix)
    transfer(source, target, [row.kind])
    expected = element_positions(target, row.access.domain) @ matrix
    assert np.abs(values_of(target, row, "Data") - expected).max() < 2e-6


def test_a_linear_vertex_group_is_carried_exactly_and_its_sum_kept() -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    for name, sign in (("Right", 1), ("Left", -1)):
        group = source.vertex_groups.new(name=name)
        for vertex in source.data.vertices:
            group.add((vertex.index,), (1 + sign * vertex.co.x) / 2, "REPLACE")
    transfer(source, target, ["vertex-groups"])
    assert np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2).max() < 1e-6
    assert np.abs(weights(target, "Right") + weights(target, "Left") - 1).max() < 1e-6


def test_a_group_that_exists_is_replaced_and_keeps_its_place_and_vertices_of_weight_zero_are_no_members() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.vertex_groups.new(name="Head").add((0, 7), 0.5, "REPLACE")
    for name in ("Head", "Other"):
        target.vertex_groups.new(name=name).add((3, 4, 7), 1.0, "REPLACE")
    transfer(source, target, ["vertex-groups"])
    assert [group.name for group in target.vertex_groups] == ["Head", "Other"]
    expected = np.zeros(36)
    expected[[0, 7]] = 0.5
    assert (weights(target, "Head") == expected).all()
    assert [v.index for v in target.data.vertices if any(g.group == 0 for g in v.groups)] == [0, 7]
    assert weights(target, "Other")[[3, 4, 7]].tolist() == [1, 1, 1]


def test_a_locked_group_is_left_alone_and_named() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    for obj, weight in ((source, 1.0), (target, 0.25)):
        obj.vertex_groups.new(name="Head").add((5,), weight, "REPLACE")
    source.vertex_groups.new(name="Free").add((1,), 1.0, "REPLACE")
    target.vertex_groups["Head"].lock_weight = True
    plan = transfer(source, target, ["vertex-groups"])
    assert weights(target, "Head")[5] == 0.25
    assert weights(target, "Free")[1] == 1
    assert plan.warnings == ("'Head' is locked on 'Target' and left as it is",)


def test_vertices_without_counterpart_keep_what_they_had() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    row = next(row for row in ATTRIBUTE_ROWS if (row.access.data_type, row.access.domain) == ("FLOAT", "POINT"))
    fill(source, row, "Data", np.ones(36))
    fill(target, row, "Data", np.full(36, 7.0))
    source.vertex_groups.new(name="Head").add(range(36), 1.0, "REPLACE")
    target.vertex_groups.new(name="Head").add(range(36), 0.5, "REPLACE")
    source.data.uv_layers.new(name="UV")
    plan = transfer(source, target, bare=slice(0, 6))
    assert values_of(target, row, "Data").ravel().tolist() == [7.0] * 6 + [1.0] * 30
    assert weights(target, "Head").tolist() == [0.5] * 6 + [1.0] * 30
    assert plan.warnings == ("6 vertices of 'Target' have no counterpart and are left as they were",)


def test_what_has_another_type_under_the_name_is_not_touched() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.data.attributes.new("Data", "FLOAT", "POINT")
    target.data.attributes.new("Data", "INT", "FACE")
    for _ in range(2):  # the second time replaces what the first has made
        plan = transfer(source, target)
        assert [layer.name for layer in plan.layers] == ["Data.001"]
        assert plan.warnings == ("'Target' has something else named 'Data': it becomes 'Data.001'",)
    assert target.data.attributes["Data"].data_type == "INT"
    assert "Data.002" not in target.data.attributes


def test_a_group_and_an_attribute_of_one_name_arrive_as_two() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.data.attributes.new("Data", "FLOAT", "POINT")
    source.vertex_groups.new(name="Data").add((1,), 1.0, "REPLACE")
    plan = transfer(source, target)
    assert [layer.name for layer in plan.layers] == ["Data", "Data.001"]
    assert weights(target, "Data")[1] == 1
    assert target.data.attributes["Data.001"].data_type == "FLOAT"


def test_a_group_and_an_attribute_of_one_name_arrive_beside_a_group_that_has_it() -> None:
    """The group that stays drives the carried one to the number that the attribute would have."""
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.data.attributes.new("Data", "FLOAT", "POINT").data[2].value = 3
    source.vertex_groups.new(name="Data").add((1,), 1.0, "REPLACE")
    target.vertex_groups.new(name="Data").add((4,), 1.0, "REPLACE")
    for _ in range(2):
        plan = plan_transfer(source, target, carrier(source, target), TransferSettings(collisions="number"))
        plan.write(target)
        assert [x.name for x in plan.layers if x.source_name == "Data"] == ["Data.001", "Data.002"]
        assert weights(target, "Data")[4] == 1
        assert weights(target, "Data.001")[1] == 1
        assert target.data.attributes["Data.002"].data[2].value == 3
        assert len(target.vertex_groups) == 2


def test_a_ninth_uv_map_is_refused_before_anything_is_written() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.vertex_groups.new(name="Head").add((1,), 1.0, "REPLACE")
    source.data.uv_layers.new(name="New")
    for number in range(8):
        target.data.uv_layers.new(name=f"UV {number}")
    before = everything(target)
    with pytest.raises(Refusal, match="'Target' would have 9 UV maps and Blender allows 8"):
        plan_transfer(source, target, carrier(source, target))
    assert everything(target) == before


def test_a_source_without_anything_to_carry_is_refused() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    with pytest.raises(Refusal, match="'Source' has no vertex groups or UV maps to transfer"):
        plan_transfer(source, target, carrier(source, target), TransferSettings(kinds=("vertex-groups", "uv")))


def test_a_source_without_anything_of_many_kinds_is_refused_in_a_few_words() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    many = TransferSettings(kinds=("vertex-groups", "shape-keys", "uv", "colors"))
    with pytest.raises(Refusal, match="'Source' has no layer of the chosen kinds to transfer"):
        plan_transfer(source, target, carrier(source, target), many)


def test_flags_that_the_target_has_already_are_not_said_to_be_missing() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    for obj in (source, target):
        obj.data.attributes.new("sharp_face", "BOOLEAN", "FACE").data[0].value = True
    settings = TransferSettings(kinds=("vertex-groups", "uv", "smoothness"))
    with pytest.raises(Refusal, match="'Target' already has everything of the chosen kinds that is on 'Source'"):
        plan_transfer(source, target, carrier(source, target), settings)


def test_what_rendered_on_the_source_renders_on_a_target_that_had_nothing() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    for name in ("First", "Second"):
        source.data.uv_layers.new(name=name)
        source.data.color_attributes.new(f"{name} Color", "BYTE_COLOR", "CORNER")
    source.data.uv_layers["Second"].active_render = True
    source.data.attributes.default_color_name = "Second Color"
    transfer(source, target)
    assert [x.name for x in target.data.uv_layers if x.active_render] == ["Second"]
    assert target.data.attributes.default_color_name == "Second Color"


def test_two_islands_of_a_uv_map_are_never_averaged() -> None:
    source, target = make_sheet("Source", 11, flat), make_sheet("Target", 16, flat)
    source.data.uv_layers.new(name="UV")
    uv = []
    for polygon in source.data.polygons:
        shift = 10.0 if polygon.center.x > 0 else 0.0
        for index in polygon.vertices:
            x, y, _ = source.data.vertices[index].co
            uv.append((x + shift, y))
    source.data.uv_layers["UV"].uv.foreach_set("vector", np.ravel(uv))
    transfer(source, target, ["uv"])
    u = corner_values(target, "UV")[:, 0]
    assert ((u <= 1e-5) | (u >= 10 - 1e-5)).all()


def test_byte_colors_survive_bit_for_bit() -> None:
    source, target = make_sheet("Source", 17, flat), make_sheet("Target", 17, flat)
    stored = np.stack(
        [np.arange(289) % 256, np.arange(289)[::-1] % 256, np.arange(289) // 2, np.full(289, 255)], axis=1
    )
    source.data.color_attributes.new("Paint", "BYTE_COLOR", "POINT")
    source.data.color_attributes["Paint"].data.foreach_set("color_srgb", (stored / 255).astype(np.float32).ravel())
    transfer(source, target, ["colors"])
    arrived = np.array([value.color_srgb[:] for value in target.data.color_attributes["Paint"].data])
    assert (np.rint(arrived * 255) == stored).all()


def test_groups_made_anew_keep_their_place_and_the_active_one_stays_active() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.vertex_groups.new(name="B").add(range(36), 0.375, "REPLACE")
    for name in "ABCD":
        target.vertex_groups.new(name=name).add((1, 2), 0.5, "REPLACE")
    target.vertex_groups.active_index = 2
    transfer(source, target, ["vertex-groups"])
    assert [group.name for group in target.vertex_groups] == ["A", "B", "C", "D"]
    assert target.vertex_groups.active.name == "C"
    assert weights(target, "B").tolist() == [0.375] * 36
    for name in "ACD":
        assert weights(target, name).tolist() == [0, 0.5, 0.5] + [0] * 33
