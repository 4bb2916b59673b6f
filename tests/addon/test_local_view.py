"""The local view that a person has open is there again after Side by Side, which has a local view of its own."""

from collections.abc import Iterator
from typing import Any

import pytest
from scenes import QUICK

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")


@pytest.fixture
def looking(pair: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The only viewport, which shows the target of an aligned pair alone."""
    from mobius_extension.mobius_addon import viewport

    bpy.ops.mobius.align(**QUICK)
    for obj in bpy.context.scene.objects:
        obj.select_set(obj == pair[1])
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    for asked in (viewport, viewport.alone):
        monkeypatch.setattr(asked, "space_of", lambda _context: area.spaces.active)
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.localview(frame_selected=False)
        yield area.spaces.active
    viewport.forget_views()


def seen(space: Any) -> set[str]:
    """Names of the objects that a viewport shows."""
    bpy.context.view_layer.update()
    drawn = bpy.context.evaluated_depsgraph_get()  # without a window Blender knows it of evaluated objects only
    return {obj.name for obj in bpy.context.scene.objects if obj.evaluated_get(drawn).visible_in_viewport_get(space)}


@pytest.mark.parametrize("selected", ["Target", "nothing"])
def test_the_end_of_side_by_side_gives_the_local_view_back(looking: Any, selected: str) -> None:
    bpy.data.objects["Target"].select_set(selected == "Target")
    assert seen(looking) == {"Target"}
    bpy.ops.mobius.side_by_side()
    assert seen(looking) == {"Source (side by side)", "Target (side by side)"}
    for obj in bpy.context.scene.objects:
        obj.select_set(False)
    bpy.ops.mobius.end_side_by_side()
    assert looking.local_view
    assert seen(looking) == {"Target"}
    assert [obj.name for obj in bpy.context.selected_objects] == ([selected] if selected == "Target" else [])


def test_shown_twice_it_is_given_back_too(looking: Any) -> None:
    bpy.ops.mobius.side_by_side()
    bpy.ops.mobius.side_by_side()
    assert seen(looking) == {"Source (side by side)", "Target (side by side)"}
    bpy.ops.mobius.end_side_by_side()
    assert seen(looking) == {"Target"}


def test_without_a_local_view_all_is_seen_afterwards(looking: Any) -> None:
    bpy.ops.view3d.localview(frame_selected=False)
    bpy.ops.mobius.side_by_side()
    bpy.ops.mobius.end_side_by_side()
    assert looking.local_view is None
    assert seen(looking) == {"Source", "Target"}
