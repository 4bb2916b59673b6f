"""Objects of several parts in Blender: each gets what is its counterpart's, and one without keeps what is its own."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.command_line.program import main  # noqa: E402

DENSE = QUICK | {"refine": "dense"}
AT = {"Left": (-0.4, 0.3, 0.25), "Right": (0.4, 0.3, 0.25), "Mole": (0.0, -0.5, 0.15)}


def with_parts(name: str, n: int, parts: tuple[str, ...], cells: int) -> Any:
    """A sheet with little balls beside it, a material of its own on each of them, joined to one object."""
    sheet = make_sheet(name, n)
    things = [sheet]
    for part in parts:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=2 * cells, ring_count=cells, radius=0.1, location=AT[part])
        ball = bpy.context.active_object
        material = bpy.data.materials.get(part) or bpy.data.materials.new(part)
        ball.data.materials.append(material)
        ball.data.uv_layers[0].name = "UVMap"
        things.append(ball)
    skin = bpy.data.materials.get("Skin") or bpy.data.materials.new("Skin")
    sheet.data.materials.append(skin)
    layer = sheet.data.uv_layers.new(name="UVMap")
    for corner, value in enumerate(layer.uv):
        value.vector = positions(sheet)[sheet.data.loops[corner].vertex_index][:2] / 2 + 0.5
    with bpy.context.temp_override(active_object=sheet, selected_editable_objects=things, object=sheet):
        bpy.ops.object.join()
    return sheet


@pytest.fixture
def pair() -> tuple[Any, Any]:
    """A source with two eyes, and a target with the same in another order and a mole, posed, with nothing on it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    source = with_parts("Source", 22, ("Left", "Right"), 8)
    target = with_parts("Target", 19, ("Mole", "Right", "Left"), 7)
    for part in ("Left", "Right"):
        source.vertex_groups.new(name=part).add(np.flatnonzero(part_of(source) == part).tolist(), 1.0, "REPLACE")
    source.vertex_groups.new(name="All").add(range(len(source.data.vertices)), 1.0, "REPLACE")
    source.shape_key_add(name="Basis")
    key = source.shape_key_add(name="Up")
    for vertex in key.data:
        vertex.co.z += 0.1
    target.data.materials.clear()
    for name in ("Old", "Mole's"):
        target.data.materials.append(bpy.data.materials.new(name))
    own = part_of(target)
    for polygon in target.data.polygons:
        polygon.material_index = int(own[polygon.vertices[0]] == "Mole")
    target.data.uv_layers.remove(target.data.uv_layers["UVMap"])
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    for vertex, place in zip(target.data.vertices, 3 * positions(target) @ turn.T + 5, strict=True):
        vertex.co = place
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    return source, target


def part_of(obj: Any) -> np.ndarray:
    """The name of the thing that each vertex is on, "Skin" for the sheet; before it is posed."""
    found = np.full(len(obj.data.vertices), "Skin", object)
    for name, at in AT.items():
        found[np.abs(np.linalg.norm(positions(obj) - at, axis=1) - 0.1) < 1e-4] = name
    return found


def before(target: Any) -> np.ndarray:
    """Where the target's vertices were before it was posed, (n, 3)."""
    return (positions(target) - 5) @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]) / 3


def names_of(target: Any) -> np.ndarray:
    found = np.full(len(target.data.vertices), "Skin", object)
    for name, at in AT.items():
        found[np.abs(np.linalg.norm(before(target) - at, axis=1) - 0.1) < 1e-4] = name
    return found


def test_each_part_gets_its_counterparts_and_one_without_keeps_its_own(pair: tuple[Any, Any]) -> None:
    source, target = pair
    assert bpy.ops.mobius.align(**DENSE) == {"FINISHED"}
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    part = names_of(target)
    for name in ("Left", "Right"):
        assert weights(target, name)[part == name] == pytest.approx(1, abs=1e-4)
        assert weights(target, name)[(part != name) & (part != "Mole")] == pytest.approx(0, abs=1e-4)
    materials = np.array([target.material_slots[p.material_index].material.name for p in target.data.polygons])
    of_polygon = np.array([part[p.vertices[0]] for p in target.data.polygons])
    assert (materials[of_polygon != "Mole"] == of_polygon[of_polygon != "Mole"]).all()
    # what rides along keeps its material, has no UVs of the skin's, and moves with it
    assert (materials[of_polygon == "Mole"] == "Mole's").all()
    of_corner = part[[loop.vertex_index for loop in target.data.loops]]
    assert not corner_values(target, "UVMap")[of_corner == "Mole"].any()
    assert np.ptp(corner_values(target, "UVMap")[of_corner == "Left"], axis=0) == pytest.approx(1, abs=0.2)
    assert weights(target, "All") == pytest.approx(1, abs=1e-4)
    moved = np.array([x.co[:] for x in target.data.shape_keys.key_blocks["Up"].data]) - positions(target)
    mole = moved[part == "Mole"]
    assert np.ptp(mole, axis=0) == pytest.approx(0, abs=0.01)
    assert np.linalg.norm(mole, axis=1) == pytest.approx(0.3, rel=0.1)
    assert source.data.shape_keys is not None


def test_the_report_and_the_stored_alignment_know_the_parts(pair: tuple[Any, Any]) -> None:
    _, target = pair
    bpy.ops.mobius.align(**DENSE)
    found = json.loads(target.data.mobius_alignment.report)
    assert len(found["parts"]) == 4
    assert sum(bool(x["source"] and x["target"]) for x in found["parts"]) == 3
    assert bpy.ops.mobius.transfer(kinds={"VERTEX_GROUPS"}) == {"FINISHED"}
    bpy.ops.mobius.align(**DENSE, parts="main")
    found = json.loads(target.data.mobius_alignment.report)
    assert found["parts"] is None
    assert found["settings"]["parts"] == "main"


def test_from_the_command_line_with_and_without_the_parts(
    pair: tuple[Any, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "both.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    flags = ["--samples", "50", "--targets", "200", "--reflect", "never"]
    arguments = ["transfer", f"{path}:Source", f"{path}:Target", *flags, "--only", "vertex-groups"]
    made = [str(tmp_path / f"{name}.blend") for name in ("whole", "again", "alone")]
    assert (
        main([*arguments, "-o", made[0], "--map", str(tmp_path / "m.npz"), "--report", str(tmp_path / "r.json")]) == 0
    )
    out = capsys.readouterr()
    assert "3 of 4 parts have a counterpart" in out.out
    assert "1 of 4 parts has no counterpart" in out.err
    assert len(json.loads((tmp_path / "r.json").read_text())["parts"]) == 4
    assert main([*arguments[:3], "--only", "vertex-groups", "-o", made[1], "--use-map", str(tmp_path / "m.npz")]) == 0
    assert main([*arguments, "-o", made[2], "--parts", "main"]) == 0
    found = []
    for name in made:
        bpy.ops.wm.open_mainfile(filepath=name)
        target = bpy.data.objects["Target"]
        found.append((names_of(target), weights(target, "Left"), weights(target, "All")))
    assert (found[0][1] == found[1][1]).all()
    assert (found[0][1][found[0][0] == "Left"] > 0.999).all()
    assert not found[2][2][found[2][0] == "Left"].any()
