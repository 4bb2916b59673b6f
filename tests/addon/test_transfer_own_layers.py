"""What the target has of its own stays, unless the person says otherwise; what a transfer wrote is made anew."""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import corner_values, make_sheet, positions, weights
from test_attributes import flat
from test_transfer_rules import add_color, add_group, carry, color
from test_transfer_shape_keys import add_key, shape

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Mask, TransferSettings, preview  # noqa: E402
from mobius_extension.mobius_addon.attributes.record import PROPERTY, unedited, written_on  # noqa: E402

N = 5
COUNT = N * N


@pytest.fixture
def sheets() -> tuple[Any, Any]:
    return make_sheet("Source", N, flat), make_sheet("Target", N, flat)


def add_uv(obj: Any, name: str, seed: int) -> np.ndarray:
    values = np.random.default_rng(seed).random((len(obj.data.loops), 2)).astype(np.float32)
    obj.data.uv_layers.new(name=name).uv.foreach_set("vector", values.ravel())
    return values


def add_number(obj: Any, name: str, seed: int, data_type: str = "FLOAT", domain: str = "POINT") -> None:
    attribute = obj.data.attributes.new(name, data_type, domain)
    values = np.random.default_rng(seed).integers(1, 100, len(attribute.data))
    attribute.data.foreach_set("value", values.astype(np.float32 if data_type == "FLOAT" else np.int32))


def numbers(obj: Any, name: str) -> list[float]:
    return [x.value for x in obj.data.attributes[name].data]


def furnish(obj: Any, seed: int) -> None:
    """Layers of every kind that has names, under names that all sheets have."""
    add_group(obj, "Head", 0.25 + 0.01 * seed)
    add_color(obj, "Paint", (0.01 * seed, 0.5, 0, 1))
    add_uv(obj, "UVMap", seed)
    add_number(obj, "Heat", seed)
    add_number(obj, "Side", seed, "INT", "FACE")
    add_key(obj, "Smile", np.random.default_rng(seed).normal(size=(COUNT, 3)))


def contents(obj: Any, suffix: str = "") -> dict[str, Any]:
    """The layers of `furnish`, with all their values."""
    return {
        "Head": weights(obj, f"Head{suffix}").tolist(),
        "Paint": color(obj, f"Paint{suffix}").tolist(),
        "UVMap": corner_values(obj, f"UVMap{suffix}").tolist(),
        "Heat": numbers(obj, f"Heat{suffix}"),
        "Side": numbers(obj, f"Side{suffix}"),
        "Smile": shape(obj, f"Smile{suffix}").tolist(),
    }


def names(obj: Any) -> set[str]:
    layers = (*obj.vertex_groups, *obj.data.attributes, *obj.data.shape_keys.key_blocks)
    return {x.name for x in layers if not x.name.startswith(".")} - {"position", "sharp_face", "Basis"}


def test_layers_that_differ_stand_beside_the_target_s_own(sheets: Any) -> None:
    source, target = sheets
    furnish(source, 1), furnish(target, 2)
    own, given = contents(target), contents(source)
    plan = carry(source, target, collisions="number")
    assert contents(target) == own
    assert contents(target, ".001") == given
    assert sorted(plan.warnings) == [
        "'Target' keeps its own UV map ('UVMap'): carried as 'UVMap.001'",
        "'Target' keeps its own attributes ('Heat', 'Side'): carried as 'Heat.001', 'Side.001'",
        "'Target' keeps its own color attribute ('Paint'): carried as 'Paint.001'",
        "'Target' keeps its own shape key ('Smile'): carried as 'Smile.001'",
        "'Target' keeps its own vertex group ('Head'): carried as 'Head.001'",
    ]
    assert TransferSettings().collisions == "number"


def test_what_is_active_and_rendered_stays_so(sheets: Any) -> None:
    source, target = sheets
    furnish(source, 1), furnish(target, 2)
    add_uv(target, "Second", 3)
    add_uv(source, "Third", 4)
    layers = target.data.uv_layers
    layers.active, layers["Second"].active_render = layers["UVMap"], True
    add_color(target, "Other", (0, 0, 1, 1))
    attributes = target.data.attributes
    attributes.active_color_name, attributes.default_color_name = "Other", "Paint"
    target.active_shape_key_index = 1
    for collisions in ("number", "replace"):
        carry(source, target, collisions=collisions)
        layers, attributes = target.data.uv_layers, target.data.attributes
        assert (layers.active.name, [x.name for x in layers if x.active_render]) == ("UVMap", ["Second"])
        assert (attributes.active_color_name, attributes.default_color_name) == ("Other", "Paint")
        assert target.active_shape_key.name == "Smile"


def test_layers_that_are_the_same_are_not_doubled_and_stay_the_person_s(sheets: Any) -> None:
    source, target = sheets
    furnish(source, 1), furnish(target, 1)
    before = names(target)
    plan = carry(source, target, collisions="number")
    assert names(target) == before
    assert plan.warnings == ()
    assert not {x.name for x in written_on(target.data)} & before
    furnish_again = contents(target)
    source.data.shape_keys.key_blocks["Smile"].points[3].co.z += 1
    source.data.uv_layers["UVMap"].uv[5].vector.x += 1
    carry(source, target, collisions="number")
    assert contents(target) == furnish_again
    assert names(target) == before | {"Smile.001", "UVMap.001"}


def test_a_layer_that_was_made_and_never_filled_is_filled(sheets: Any) -> None:
    source, target = sheets
    furnish(source, 1)
    target.vertex_groups.new(name="Head")
    target.shape_key_add(name="Basis")
    target.shape_key_add(name="Smile")
    target.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.zeros(2 * len(target.data.loops)))
    plan = carry(source, target, collisions="number")
    assert plan.warnings == ()
    assert names(target) == names(source)
    assert contents(target) == contents(source)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edited=st.sets(st.sampled_from(["Head", "Paint", "UVMap", "Heat", "Side", "Smile"])),
    own=st.booleans(),
    runs=st.integers(1, 3),
    sources=st.integers(1, 2),
)
def test_a_transfer_done_again_replaces_what_it_wrote_and_nobody_edited(
    empty_scene: Any, edited: set[str], own: bool, runs: int, sources: int
) -> None:
    """However often, from however many sources: one carried layer of a name, and one more for each that was edited."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    target = make_sheet("Target", N, flat)
    given = [make_sheet(f"Source {k}", N, flat) for k in range(sources)]
    for number, obj in enumerate(given):
        furnish(obj, 10 + number)
    if own:
        furnish(target, 1)
    before = contents(target) if own else None
    suffix = ".001" if own else ""
    for source in given * runs:
        carry(source, target, collisions="number")
        close(contents(target, suffix), contents(source))
    expected = {f"{name}{suffix}" for name in contents(given[0])} | (set(contents(given[0])) if own else set())
    assert names(target) == expected
    for name in edited:
        edit(target, name, suffix)
    changed = contents(target, suffix)
    carry(given[0], target, collisions="number")
    following = ".002" if own else ".001"
    now = contents(target, suffix)
    for name in edited:
        close({name: now[name]}, {name: changed[name]})
    assert names(target) == expected | {f"{name}{following}" for name in edited}
    if own:
        close(contents(target), before)


def close(found: dict[str, Any], wanted: Any) -> None:
    for name, values in wanted.items():
        assert np.allclose(found[name], values, atol=1e-5), name


def edit(obj: Any, name: str, suffix: str) -> None:
    """Change one value of a layer."""
    full = f"{name}{suffix}"
    if name == "Head":
        obj.vertex_groups[full].add((3,), 0.875, "REPLACE")
    elif name == "Smile":
        obj.data.shape_keys.key_blocks[full].points[3].co.z += 0.5
    elif name == "UVMap":
        obj.data.uv_layers[full].uv[3].vector = (7, 7)
    elif name == "Paint":
        obj.data.attributes[full].data[3].color = (0.5, 0.25, 1, 1)
    else:
        obj.data.attributes[full].data[3].value += 1


def test_the_record_is_saved_copied_and_survives_nonsense(sheets: Any, tmp_path: Any) -> None:
    source, target = sheets
    furnish(source, 1)
    carry(source, target, collisions="number")
    assert {x.name for x in unedited(target)} == {x.name for x in written_on(target.data)} >= set(contents(source))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    source, target = bpy.data.objects["Source"], bpy.data.objects["Target"]
    before = names(target)
    source.data.uv_layers["UVMap"].uv[5].vector.x += 1
    carry(source, target, collisions="number")
    assert names(target) == before
    for nonsense in ("", "no list", "[1]", '[{"kind": 3}]', "{}", 7):
        target.data[PROPERTY] = nonsense
        assert written_on(target.data) == ()
    source.data.uv_layers["UVMap"].uv[5].vector.x += 1
    carry(source, target, collisions="number")
    assert names(target) == before | {"UVMap.001"}


def test_the_numbered_names_keep_clear_of_what_else_is_carried(sheets: Any) -> None:
    source, target = sheets
    for number, name in enumerate(("Heat", "Heat.001", "Heat.002")):
        add_number(source, name, number)
    add_number(target, "Heat", 7)
    own = numbers(target, "Heat")
    for _ in range(2):
        carry(source, target, collisions="number")
        assert numbers(target, "Heat") == own
        assert numbers(target, "Heat.001") == numbers(source, "Heat.001")
        assert numbers(target, "Heat.002") == numbers(source, "Heat.002")
        assert numbers(target, "Heat.003") == numbers(source, "Heat")


def test_a_ninth_uv_map_beside_one_s_own_is_refused(sheets: Any) -> None:
    source, target = sheets
    add_uv(source, "UV 0", 1)
    for number in range(8):
        add_uv(target, f"UV {number}", 10 + number)
    with pytest.raises(Exception, match="'Target' would have 9 UV maps and Blender allows 8"):
        carry(source, target, collisions="number")
    carry(source, target, collisions="replace")
    assert len(target.data.uv_layers) == 8


def test_a_mix_and_a_mask_join_what_is_there(sheets: Any) -> None:
    source, target = sheets
    add_group(source, "Head", 0.5), add_group(target, "Head", 0.25)
    add_uv(source, "UVMap", 1)
    own = add_uv(target, "UVMap", 2)
    plan = carry(source, target, collisions="number", mix="add")
    assert weights(target, "Head") == pytest.approx(0.75)
    assert (corner_values(target, "UVMap") == own).all()
    assert "'Target' keeps its own UV map ('UVMap'): carried as 'UVMap.001'" in plan.warnings
    half = positions(target)[:, 0] > 0
    add_group(target, "Half", half.astype(float))
    mask = Mask("named", "Half")
    plan = carry(source, target, collisions="number", kinds=("vertex-groups", "uv"), target_mask=mask)
    assert weights(target, "Head") == pytest.approx(np.where(half, 0.5, 0.75))
    assert target.data.uv_layers.keys() == ["UVMap", "UVMap.001"]


def test_a_layer_beside_has_the_target_s_own_values_where_nothing_is_carried(sheets: Any) -> None:
    source, target = sheets
    add_number(source, "Heat", 1), add_number(target, "Heat", 2)
    carry(source, target, bare=slice(0, 5), unmatched="leave", collisions="number")
    assert numbers(target, "Heat.001") == numbers(target, "Heat")[:5] + numbers(source, "Heat")[5:]


# what a mesh has once


def cut(obj: Any, edge: int) -> None:
    obj.data.edges[edge].use_seam = True


def test_seams_of_one_s_own_that_are_replaced_are_named(sheets: Any) -> None:
    source, target = sheets
    cut(source, 3), cut(target, 7)
    said = "'Target' had other UV seams, which a mesh has once: they are replaced"
    assert carry(source, target, collisions="number").warnings == (said,)
    cut(source, 9)
    assert carry(source, target, collisions="number").warnings == ()  # what is there was carried
    cut(target, 12)
    assert carry(source, target, collisions="number").warnings == (said,)
    cut(target, 12)
    assert carry(source, target, collisions="replace").warnings == ()


# materials and the UV map that they use


def paint(obj: Any, name: str) -> Any:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    obj.data.materials.append(material)
    return material


def test_carried_materials_are_rendered_with_their_own_map(sheets: Any) -> None:
    source, target = sheets
    add_uv(source, "UVMap", 1), add_uv(target, "UVMap", 2)
    paint(source, "Skin"), paint(target, "Cloth")
    plan = carry(source, target, collisions="number", kinds=("uv",))
    assert [x.name for x in target.data.uv_layers if x.active_render] == ["UVMap"]
    plan = carry(source, target, collisions="number")
    assert [x.name for x in target.data.uv_layers if x.active_render] == ["UVMap.001"]
    assert "'Target' is rendered with the UV map 'UVMap.001', as its carried materials expect" in plan.warnings
    assert "'Target' had other materials, which a mesh has once: they are replaced" in plan.warnings


def test_a_node_that_names_a_map_is_pointed_out_where_that_has_another_name(sheets: Any) -> None:
    source, target = sheets
    add_uv(source, "UVMap", 1), add_uv(target, "UVMap", 2)
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.nodes.new("ShaderNodeUVMap").uv_map = "UVMap"
    tree = paint(source, "Skin").node_tree
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    plan = carry(source, target, collisions="number")
    assert "the nodes of material 'Skin' name 'UVMap', which is 'UVMap.001' on 'Target'" in plan.warnings


# before it happens


def test_the_preview_tells_what_is_kept_and_replaced(sheets: Any) -> None:
    source, target = sheets
    furnish(source, 1), furnish(target, 2)
    cut(source, 3), cut(target, 7)
    add_uv(target, "Other", 3)
    every = TransferSettings()
    met = preview(source, target, every)
    assert sorted(met.kept) == ["Head", "Heat", "Paint", "Side", "Smile", "UVMap"]
    assert met.replaced == ()
    assert "UV Seams" in met.kinds
    met = preview(source, target, TransferSettings(collisions="replace", kinds=("uv", "vertex-groups")))
    assert (met.kept, sorted(met.replaced), met.kinds) == ((), ["Head", "UVMap"], ())
    met = preview(source, target, TransferSettings(mix="add", layers="named", names=("UV*", "Head")))
    assert (met.kept, met.replaced) == (("UVMap",), ("Head",))
    target.vertex_groups.remove(target.vertex_groups["Head"])
    carry(source, target, collisions="number")
    assert "Head" not in preview(source, target, every).kept
    assert "UVMap" in preview(source, target, every).kept
    assert preview(source, target, every).kinds == ()
