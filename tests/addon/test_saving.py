"""A file that is saved while source and target are shown side by side holds nothing of that, and loses nothing else."""

from pathlib import Path
from typing import Any

import pytest
from scenes import QUICK, everything, make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import PATTERN_COLOR  # noqa: E402
from mobius_extension.mobius_addon.comparison import COLLECTION, copies  # noqa: E402


@pytest.fixture
def shown(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    """Two aligned sheets, the source selected and active, shown side by side."""
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    for obj in pair:
        obj.select_set(obj == pair[0])
    bpy.context.view_layer.objects.active = pair[0]
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    return pair


def blocks() -> dict[str, list[str]]:
    kinds = ("objects", "meshes", "collections", "materials", "images")
    return {kind: sorted(x.name for x in getattr(bpy.data, kind) if x.name != "Render Result") for kind in kinds}


def in_the_file(path: Path) -> tuple[dict[str, list[str]], list[str], str]:
    """Open a file: what is in it, what is selected and what is active."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    active = bpy.context.view_layer.objects.active
    return blocks(), [obj.name for obj in bpy.context.selected_objects], active.name if active else ""


def test_the_copies_are_not_saved_and_stay_shown(shown: tuple[Any, Any], tmp_path: Path) -> None:
    path = tmp_path / "saved.blend"
    before = {obj.name: str(everything(obj)) for obj in shown}
    there = blocks()
    selected = {obj.name for obj in bpy.context.selected_objects}
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert blocks() == there
    assert copies(bpy.context) is not None
    assert {obj.name for obj in bpy.context.selected_objects} == selected
    assert bpy.context.object == copies(bpy.context)[1]
    found, chosen, active = in_the_file(path)
    assert found["objects"] == ["Source", "Target"]
    assert COLLECTION not in found["collections"]
    assert [x.name for x in bpy.context.scene.collection.children if x.name == COLLECTION] == []
    assert (chosen, active) == (["Source"], "Source")
    assert PATTERN_COLOR in bpy.data.meshes["Target"].color_attributes  # which Align has left, and Clear takes away
    assert {name: str(everything(bpy.data.objects[name])) for name in before} == before
    # what was saved can be shown again
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert bpy.ops.mobius.end_side_by_side() == {"FINISHED"}
    assert [obj.name for obj in bpy.context.selected_objects] == ["Source"]


@pytest.mark.parametrize("steps", [("undo", "redo"), ("undo", "redo", "undo")])
def test_undo_and_redo_change_nothing_of_that(pair: tuple[Any, Any], tmp_path: Path, steps: tuple[str, ...]) -> None:
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    for step in steps:
        getattr(bpy.ops.ed, step)()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"), copy=True)
    assert in_the_file(tmp_path / "saved.blend")[0]["objects"] == ["Source", "Target"]


def test_a_save_that_fails_leaves_everything_as_it_is(shown: tuple[Any, Any], tmp_path: Path) -> None:
    selected = {obj.name for obj in bpy.context.selected_objects}
    with pytest.raises(RuntimeError):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "no" / "such" / "folder.blend"))
    assert {obj.name for obj in bpy.context.selected_objects} == selected
    assert copies(bpy.context) is not None


@pytest.mark.parametrize("how", ["save", "end"])
def test_what_a_person_puts_beside_the_copies_is_kept(shown: tuple[Any, Any], tmp_path: Path, how: str) -> None:
    mine = make_sheet("Mine", 3)
    for collection in mine.users_collection:
        collection.objects.unlink(mine)
    bpy.data.collections[COLLECTION].objects.link(mine)
    if how == "end":
        bpy.ops.mobius.end_side_by_side()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert in_the_file(tmp_path / "saved.blend")[0]["objects"] == ["Mine", "Source", "Target"]
    assert "Mine" in bpy.context.scene.objects


def test_a_file_is_saved_while_a_copy_is_edited(shown: tuple[Any, Any], tmp_path: Path) -> None:
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.context.object.name not in ("Source", "Target")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert in_the_file(tmp_path / "saved.blend")[0]["objects"] == ["Source", "Target"]
