"""The example and the guide: what a beginner finds, and how it goes away again."""

import webbrowser
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.operators import example  # noqa: E402


def everything() -> dict[str, set[str]]:
    """The names of all data that the example could leave behind."""
    return {kind: set(getattr(bpy.data, kind).keys()) for kind in ("objects", "meshes", "collections", "materials")}


def test_the_example_comes_in_its_own_collection_and_goes_without_a_trace(empty_scene: Any) -> None:
    own = bpy.data.objects.new("Own", None)
    empty_scene.collection.objects.link(own)
    before = everything()
    assert bpy.ops.mobius.load_example() == {"FINISHED"}
    settings = bpy.context.scene.mobius
    collection = bpy.data.collections[example.COLLECTION]
    assert set(collection.objects) == {settings.source, settings.target}
    assert set(empty_scene.collection.objects) == {own}
    assert settings.source.vertex_groups
    with pytest.raises(RuntimeError, match="already"):
        bpy.ops.mobius.load_example()
    assert bpy.ops.mobius.remove_example() == {"FINISHED"}
    assert everything() == before
    with pytest.raises(RuntimeError, match="no example"):
        bpy.ops.mobius.remove_example()


def test_undo_takes_the_example_back(empty_scene: Any) -> None:
    before = everything()
    bpy.ops.mobius.load_example("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    assert everything() == before


def test_undo_brings_a_removed_example_back(empty_scene: Any) -> None:
    bpy.ops.mobius.load_example("EXEC_DEFAULT", True)
    before, chosen = everything(), empty_scene.mobius.source.name
    bpy.ops.mobius.remove_example("EXEC_DEFAULT", True)
    assert everything() != before
    bpy.ops.ed.undo()
    assert everything() == before
    assert bpy.context.scene.mobius.source.name == chosen
    bpy.ops.ed.redo()
    assert chosen not in bpy.data.objects


def test_the_guide_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert bpy.ops.mobius.guide() == {"FINISHED"}
    assert opened == [example.GUIDE.as_uri()]
    monkeypatch.setattr(example, "GUIDE", example.GUIDE.with_name("none.html"))
    with pytest.raises(RuntimeError, match="missing"):
        bpy.ops.mobius.guide()
