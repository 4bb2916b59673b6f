"""What a command writes into a .blend: the scene that the mesh comes from, with nothing lost and nothing left over."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import QUICK, listing, run
from rich_scene import Scene, build, make_source
from scenes import make_sheet, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

CARRY = ["--only", "vertex-groups", *QUICK]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "source" / "source.blend"
    path.parent.mkdir()
    make_source(path)
    return path


def opened(path: Path) -> Any:
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    return bpy.data.objects["Target"]


def remarks(err: str) -> list[str]:
    """What is said, but for how a coarse sheet is read."""
    return [line for line in err.splitlines() if not line.endswith("smoothed, for the computation only")]


def test_a_rig_keeps_its_mesh(tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = Scene(parent="BONE", scale=(100, 100, 100), modifiers=("ARMATURE",), keys=1, key_driver=True)
    path = build(scene, tmp_path / "rig")
    world = np.array(opened(path).matrix_world)
    status, _, err = run(capsys, "transfer", source, f"{path}:Target", "-o", tmp_path / "out.blend", *CARRY)
    assert (status, remarks(err)) == (0, [])
    target = opened(tmp_path / "out.blend")
    rig = bpy.data.objects["Rig"]
    assert (target.parent, target.parent_bone, target.modifiers[0].object) == (rig, "Own 0", rig)
    assert np.array(target.matrix_world) == pytest.approx(world)
    (curve,) = target.data.shape_keys.animation_data.drivers
    assert curve.driver.variables[0].targets[0].id == rig
    assert weights(target, "From Source").max() == pytest.approx(0.5)


@pytest.mark.parametrize("place", ["EXCLUDED", "HIDDEN", "DISABLED", "UNSELECTABLE", "OTHER SCENE", "NO SCENE"])
@pytest.mark.parametrize("ending", [".blend", ".glb", ".usdc"])
def test_a_mesh_that_cannot_be_seen_or_selected_is_written(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str], place: str, ending: str
) -> None:
    path = build(Scene(place=place, scale=(-1, 1, 1)), tmp_path / "scene")
    out = tmp_path / f"out{ending}"
    status, _, err = run(capsys, "flatten", f"{path}:Target", "-o", out)
    assert status == 0, err
    assert run(capsys, "check", f"{out}:Target" if ending == ".blend" else out)[0] == 0


@pytest.mark.parametrize("mode", ["EDIT", "WEIGHT_PAINT", "VERTEX_PAINT", "SCULPT"])
def test_a_file_saved_in_another_mode_is_still_in_it(
    mode: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build(Scene(mode=mode, groups=1, modifiers=("SOLIDIFY",), others=("CAMERA",)), tmp_path / "scene")
    assert run(capsys, "flatten", f"{path}:Target", "-o", tmp_path / "out.blend")[0] == 0
    target = opened(tmp_path / "out.blend")
    assert target.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "Mobius Disc" in target.data.uv_layers
    views = [area.spaces.active.region_3d for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    assert [view.view_perspective for view in views] == ["CAMERA"] * len(views)


def test_an_input_is_written_over_only_when_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = build(Scene(others=("LIGHT",)), tmp_path / "scene")
    before, names = path.read_bytes(), listing(tmp_path)
    link = tmp_path / "link.blend"
    link.symlink_to(path)
    for out in (path, link):
        status, _, err = run(capsys, "flatten", f"{path}:Target", "-o", out)
        assert (status, err) == (2, f"mobius: '{out}' is read by this command: name another file, or say --overwrite\n")
    assert run(capsys, "flatten", f"{path}:Target", "-o", tmp_path / "x.blend", "--report", path)[0] == 2
    assert path.read_bytes() == before
    link.unlink()
    assert run(capsys, "flatten", f"{path}:Target", "-o", path, "--overwrite")[0] == 0
    assert listing(tmp_path) == sorted({*names, "scene.blend1"})
    assert path.with_name("scene.blend1").read_bytes() == before
    assert "Mobius Disc" in opened(path).data.uv_layers
    assert "Light" in bpy.data.objects


def test_of_a_source_in_another_file_only_what_is_used_comes_along(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build(Scene(pictures=("FILE",), others=("CAMERA",)), tmp_path / "scene")
    opened(path)
    before = {repr(x) for x in bpy.data.user_map()}
    assert run(capsys, "transfer", source, f"{path}:Target", "-o", tmp_path / "out.blend", *CARRY)[0] == 0
    opened(tmp_path / "out.blend")
    assert {repr(x) for x in bpy.data.user_map()} == before
    (tmp_path / "deep").mkdir()
    out = tmp_path / "deep" / "out.blend"
    assert run(capsys, "transfer", source, f"{path}:Target", "-o", out, "--only", "materials", *QUICK)[0] == 0
    target = opened(out)
    assert [slot.material.name for slot in target.material_slots] == ["Own FILE 0", "Source Material"]
    added = {x.name for x in bpy.data.user_map() if repr(x) not in before}
    assert added == {"Source Material", "Source Material Group", "skin.png.001"}
    # both pictures are called skin.png, and both are found from the new file
    folders = {Path(bpy.path.abspath(x.filepath)).resolve().parent for x in bpy.data.images if x.source == "FILE"}
    assert {folder.name for folder in folders} >= {"0", "source pictures"}
    assert all(Path(bpy.path.abspath(x.filepath)).is_file() for x in bpy.data.images if x.source == "FILE")


def test_a_driver_that_points_into_the_sources_file_is_said_and_left(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(source))
    handle = bpy.data.objects.new("Handle", None)
    bpy.context.scene.collection.objects.link(handle)
    driver = bpy.data.objects["Source"].data.shape_keys.key_blocks["Source Key"].driver_add("value").driver
    variable = driver.variables.new()
    variable.type, variable.targets[0].id = "TRANSFORMS", handle
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    path = build(Scene(), tmp_path / "scene")
    out = tmp_path / "out.blend"
    status, _, err = run(capsys, "transfer", source, f"{path}:Target", "-o", out, "--only", "shape-keys", *QUICK)
    assert status == 0
    assert "points at 'Handle' in" in err
    target = opened(out)
    assert "Source Key" in target.data.shape_keys.key_blocks
    assert "Handle" not in bpy.data.objects
    data = target.data.shape_keys.animation_data
    assert data is None or not data.drivers


@pytest.mark.parametrize("way", ["LINKED", "OVERRIDE"])
def test_what_is_linked_is_read_and_neither_changed_nor_replaced(
    way: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build(Scene(others=(way,)), tmp_path / "scene")
    out, library = tmp_path / "out.blend", tmp_path / "scene" / "library.blend"
    status, _, err = run(capsys, "flatten", f"{path}:Linked", "-o", out)
    assert status == 1
    assert f"'Linked' in '{path}' is linked from 'library.blend' and cannot be changed" in err
    assert not out.exists()
    status, _, err = run(capsys, "flatten", f"{path}:Target", "-o", library)
    assert (status, "is linked by the file that would be written there" in err) == (1, True)
    status, _, err = run(capsys, "transfer", f"{path}:Linked", f"{path}:Target", "-o", out, *CARRY)
    assert (status, remarks(err)) == (0, [])
    assert weights(opened(out), "From Library").max() == pytest.approx(0.5)
    mesh = bpy.data.objects["Linked"].data
    assert mesh.library is not None
    # so it is from another file, which leaves nothing behind
    other = build(Scene(), tmp_path / "other")
    status, _, err = run(capsys, "transfer", f"{path}:Linked", f"{other}:Target", "-o", out, *CARRY)
    assert (status, remarks(err)) == (0, [])
    assert weights(opened(out), "From Library").max() == pytest.approx(0.5)
    assert not bpy.data.libraries
    assert not any(x.name.startswith("Linked") for x in bpy.data.objects)


def test_each_of_several_targets_of_one_file_has_its_scene(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build(Scene(others=("LIGHT",)), tmp_path / "scene")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    make_sheet("Second", 11)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    results = tmp_path / "results"
    results.mkdir()
    status, _, err = run(capsys, "transfer", source, f"{path}:Target", f"{path}:Second", "-o", results, *CARRY)
    assert (status, remarks(err)) == (0, [])
    assert listing(results) == ["scene Second.blend", "scene Target.blend"]
    for name, other in (("Target", "Second"), ("Second", "Target")):
        opened(results / f"scene {name}.blend")
        assert sorted(x.name for x in bpy.data.objects) == ["Light", "Second", "Target"]
        assert "From Source" in bpy.data.objects[name].vertex_groups
        assert "From Source" not in bpy.data.objects[other].vertex_groups


def test_the_scene_of_a_target_in_another_format_is_all_that_its_file_holds(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build(Scene(parent="EMPTY", scale=(2, 2, 2)), tmp_path / "scene")
    opened(path)
    made = tmp_path / "made.fbx"
    bpy.ops.preferences.addon_enable(module="io_scene_fbx")
    bpy.ops.export_scene.fbx(filepath=str(made))
    out = tmp_path / "out.blend"
    assert run(capsys, "transfer", source, made, "-o", out, *CARRY)[0] == 0
    target = opened(out)
    assert target.parent == bpy.data.objects["Holder"]
    assert sorted(x.name for x in bpy.data.objects) == ["Holder", "Target"]
    assert "From Source" in target.vertex_groups


def test_a_later_run_over_an_own_result_works(tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = build(Scene(), tmp_path / "scene"), tmp_path / "out.blend"
    for _ in range(2):
        assert run(capsys, "transfer", source, f"{path}:Target", "-o", out, *CARRY)[0] == 0
    names = listing(tmp_path)
    assert run(capsys, "flatten", f"{out}:Target", "-o", out, "--overwrite")[0] == 0
    assert listing(tmp_path) == sorted([*names, "out.blend1"])
