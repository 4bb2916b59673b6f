"""Every type of attribute on every domain, and the layers that have a meaning of their own to Blender."""

from typing import Any

import numpy as np
import pytest
from scenes import make_sheet, positions
from test_attributes import ALL, EVERY_ROW, flat, transfer

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import plan_transfer  # noqa: E402,F401

SIZE = {"POINT": "vertices", "EDGE": "edges", "FACE": "polygons", "CORNER": "loops"}


def random_values(data_type: str, count: int, width: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    if data_type == "STRING":
        return np.array([b"word %d" % number for number in rng.integers(0, 9, count)], object)
    if data_type == "BOOLEAN":
        return rng.random(count) < 0.5
    if data_type.startswith("INT"):
        return rng.integers(-100, 100, (count, width)).astype(np.int32)
    return rng.normal(size=(count, width)).astype(np.float32)


def put(obj: Any, row: Any, name: str, values: np.ndarray) -> None:
    obj.data.attributes.new(name, row.access.data_type, row.access.domain)
    row.access.write(obj, name, values, np.ones(len(values), bool))


def name_of(row: Any) -> str:
    return f"{row.access.data_type}-{row.access.domain}"


@pytest.mark.parametrize("row", EVERY_ROW, ids=name_of)
def test_every_type_comes_back_from_an_identical_mesh_bit_for_bit(row: Any) -> None:
    source, target = make_sheet("Source", 7), make_sheet("Target", 7)
    count = len(getattr(source.data, SIZE[row.access.domain]))
    put(source, row, "Data", random_values(row.access.data_type, count, row.access.width))
    transfer(source, target, [row.kind])
    arrived = target.data.attributes["Data"]
    assert (arrived.data_type, arrived.domain) == (row.access.data_type, row.access.domain)
    assert (row.access.read(target, "Data") == row.access.read(source, "Data")).all()


@pytest.mark.parametrize(
    "row",
    [r for r in EVERY_ROW if r.access.data_type in ("STRING", "BOOLEAN", "INT", "INT8", "INT32_2D", "FLOAT4X4")],
    ids=name_of,
)
def test_no_new_value_arises_between_different_meshes(row: Any) -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    count = len(getattr(source.data, SIZE[row.access.domain]))
    put(source, row, "Data", random_values(row.access.data_type, count, row.access.width))
    transfer(source, target, [row.kind])
    there = {str(x) for x in row.access.read(source, "Data")}
    assert {str(x) for x in row.access.read(target, "Data")} <= there


def test_quaternions_are_turned_the_shorter_way_and_stay_of_unit_length() -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    row = next(r for r in EVERY_ROW if name_of(r) == "QUATERNION-POINT")
    angle = 0.4 * positions(source)[:, 0]
    values = np.stack([np.cos(angle), np.sin(angle), 0 * angle, 0 * angle], axis=1)
    values[::2] *= -1
    put(source, row, "Data", values)
    transfer(source, target, ["attributes"])
    arrived = row.access.read(target, "Data")
    assert np.abs(np.linalg.norm(arrived, axis=1) - 1).max() < 1e-6
    expected = 0.4 * positions(target)[:, 0]
    assert np.abs(arrived[:, 1] / arrived[:, 0] - np.tan(expected)).max() < 2e-3


def test_faces_take_the_face_in_which_their_middle_lies() -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    row = next(r for r in EVERY_ROW if name_of(r) == "INT-FACE")
    put(source, row, "Data", np.arange(64))
    transfer(source, target, ["attributes"])
    middle = np.array([polygon.center[:2] for polygon in target.data.polygons])
    # row by row, as the sheet is made
    i, j = np.minimum((middle + 1) * 4, 7).astype(int).T
    arrived = row.access.read(target, "Data")
    # where the middle of the larger triangle, not of the polygon, may lie in the next face
    clear = (np.abs((middle + 1) * 4 % 1 - 0.5) < 0.25).all(axis=1)
    assert clear.sum() > 20
    assert (arrived == 8 * j + i)[clear].all()


def test_materials_seams_sharp_edges_creases_face_sets_mask_and_smoothness_arrive() -> None:
    source, target = make_sheet("Source", 7), make_sheet("Target", 7)
    rng = np.random.default_rng(1)
    skin, hair, eye = (bpy.data.materials.new(name) for name in ("Skin", "Hair", "Eye"))
    for material in (skin, hair):
        source.data.materials.append(material)
    for material in (eye, hair):
        target.data.materials.append(material)
    mesh = source.data
    edges, faces = len(mesh.edges), len(mesh.polygons)
    slot = rng.integers(0, 2, faces)
    mesh.polygons.foreach_set("material_index", slot.astype(np.int32))
    given = {name: rng.random(edges) < 0.3 for name in ("use_seam", "use_edge_sharp")}
    for name, values in given.items():
        mesh.edges.foreach_set(name, values)
    smooth = rng.random(faces) < 0.5
    mesh.polygons.foreach_set("use_smooth", smooth)
    numbers = {
        "crease_edge": ("FLOAT", "EDGE", rng.random(edges).astype(np.float32)),
        "bevel_weight_vert": ("FLOAT", "POINT", rng.random(49).astype(np.float32)),
        ".sculpt_face_set": ("INT", "FACE", rng.integers(1, 5, faces).astype(np.int32)),
        ".sculpt_mask": ("FLOAT", "POINT", rng.random(49).astype(np.float32)),
    }
    for name, (data_type, domain, values) in numbers.items():
        mesh.attributes.new(name, data_type, domain)
        mesh.attributes[name].data.foreach_set("value", values)
    plan = transfer(source, target)
    assert plan.warnings == ()
    assert [s.material.name for s in target.material_slots] == ["Eye", "Hair", "Skin"]
    assert [p.material_index for p in target.data.polygons] == [(2, 1)[number] for number in slot]
    for name, values in given.items():
        assert [getattr(edge, name) for edge in target.data.edges] == values.tolist()
    assert [p.use_smooth for p in target.data.polygons] == smooth.tolist()
    for name, (_, _, values) in numbers.items():
        assert [x.value for x in target.data.attributes[name].data] == values.tolist()
    # what is the same already is no reason to write or to speak of it
    assert set(plan_transfer_again(source, target)) == {"materials"}


def plan_transfer_again(source: Any, target: Any) -> dict[str, int]:
    return transfer(source, target, ALL).counts()


def test_faces_without_counterpart_keep_their_material_and_face_set() -> None:
    source, target = make_sheet("Source", 6, flat), make_sheet("Target", 6, flat)
    source.data.materials.append(bpy.data.materials.new("Skin"))
    target.data.materials.append(bpy.data.materials.new("Cloth"))
    for obj, number in ((source, 3), (target, 8)):
        obj.data.attributes.new(".sculpt_face_set", "INT", "FACE")
        obj.data.attributes[".sculpt_face_set"].data.foreach_set("value", np.full(25, number, np.int32))
    transfer(source, target, bare=slice(0, 6))
    assert [p.material_index for p in target.data.polygons] == [0] * 5 + [1] * 20
    assert [x.value for x in target.data.attributes[".sculpt_face_set"].data] == [8] * 5 + [3] * 20
