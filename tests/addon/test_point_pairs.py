"""Point pairs: added, moved, removed, outvoted, undone, saved, and what shows the map going with it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import point_pairs, stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402


@pytest.fixture
def aligned(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    target = pair[1]
    target.location, target.rotation_euler, target.scale = (3, 1, 2), (0.3, 0.2, 1), (2, 2, 2)
    bpy.context.view_layer.update()
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    return pair


def carried(source: Any, target: Any) -> np.ndarray:
    """Where each target vertex goes on the source, (n, 3)."""
    surfaces = read_surface(source), read_surface(target)
    return stored_alignment.load(target, source, surfaces).matrix() @ surfaces[0].mesh.vertices


def vertex_at(target: Any, x: float, y: float) -> int:
    return int(np.linalg.norm(positions(target)[:, :2] - (x, y), axis=1).argmin())


def add(source: Any, target: Any, vertex: int, shift: tuple[float, float] = (0.05, 0.03), **options: Any) -> np.ndarray:
    """Pair a target vertex with a point beside where it goes, and return that point."""
    x, y = carried(source, target)[vertex, :2] + shift
    near = read_surface(source).mesh
    goal = near.vertices[np.linalg.norm(near.vertices[:, :2] - (x, y), axis=1).argmin()]
    point = positions(target)[vertex]
    done = bpy.ops.mobius.add_pair("EXEC_DEFAULT", True, source_point=goal, target_point=point, **options)
    assert done == {"FINISHED"}
    return goal


def test_a_pair_bends_the_map_and_what_shows_it_and_goes_without_a_trace(aligned):
    source, target = aligned
    vertex, far = vertex_at(target, 0.3, 0.2), vertex_at(target, -0.9, -0.9)
    before, layout, report = carried(*aligned), corner_values(target, "Mobius"), target.data.mobius_alignment.report
    goal = add(source, target, vertex, follow_all=True)
    now = carried(*aligned)
    assert np.linalg.norm(now[vertex] - goal) < 1e-4
    assert (now[far] == before[far]).all()
    loops = [loop.index for loop in target.data.loops if loop.vertex_index == vertex]
    assert np.abs(corner_values(target, "Mobius") - layout)[loops].max() > 1e-3
    assert target.data.mobius_alignment.report == report
    (one,) = point_pairs.listed(source, target)
    assert one.followed
    assert point_pairs.are_applied(source, target)
    assert bpy.ops.mobius.remove_pair("EXEC_DEFAULT", True, pair=one.name) == {"FINISHED"}
    assert (carried(*aligned) == before).all()
    # the map that is kept ends at the straight edges between vertices of the rim, the layout at the circle
    assert np.abs(corner_values(target, "Mobius") - layout).max() < 2e-3
    assert point_pairs.COLLECTION not in bpy.data.collections
    assert not target.data.mobius_alignment.unbent
    assert point_pairs.are_applied(source, target)


def test_the_order_of_pairs_does_not_matter_and_moving_one_is_noticed(aligned):
    source, target = aligned
    for x, y in ((0.3, 0.2), (-0.4, -0.3)):
        add(source, target, vertex_at(target, x, y), follow_all=True)
    both = carried(*aligned)
    assert bpy.ops.mobius.bend_through_pairs(follow_all=True) == {"FINISHED"}
    assert (carried(*aligned) == both).all()
    empty = bpy.data.objects[point_pairs.listed(source, target)[0].source]
    empty.location.x += 0.1
    bpy.context.view_layer.update()
    assert [pair.followed for pair in point_pairs.listed(source, target)] == [None, True]
    assert not point_pairs.are_applied(source, target)
    assert bpy.ops.mobius.bend_through_pairs(follow_all=True) == {"FINISHED"}
    assert point_pairs.are_applied(source, target)
    assert (carried(*aligned) != both).any()


def test_a_wrong_pair_is_outvoted_named_and_can_be_insisted_on(aligned, monkeypatch):
    source, target = aligned
    # a map that is sure of itself
    surfaces = read_surface(source), read_surface(target)
    found = stored_alignment.load(target, source, surfaces)
    sure = type(found)(**{**vars(found), "confidence": np.full(len(found.face), 0.99)})
    target.data.mobius_alignment.packed = stored_alignment._packed(sure)
    before, vertex = carried(*aligned), vertex_at(target, 0.3, 0.2)
    goal = add(source, target, vertex, (-0.8, 0.3))
    assert (carried(*aligned) == before).all()
    (one,) = point_pairs.listed(source, target)
    assert one.followed is False
    assert one.missed > 0.2
    monkeypatch.setattr(point_pairs, "rpt_", lambda text: text)
    kind, said = point_pairs.describe(*point_pairs.bend(source, target, follow_all=False))
    assert kind == "WARNING"
    assert "'Pair 1'" in said
    assert bpy.ops.mobius.bend_through_pairs(follow_all=True) == {"FINISHED"}
    assert np.linalg.norm(carried(*aligned)[vertex] - goal) < 1e-3


def test_undo_takes_a_pair_back_and_the_file_keeps_it(aligned, tmp_path: Path):
    source, target = aligned
    bpy.ops.ed.undo_push(message="aligned")
    before, vertex = carried(*aligned), vertex_at(target, 0.3, 0.2)
    add(source, target, vertex, follow_all=True)
    after = carried(*aligned)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "pairs.blend"), copy=True)
    bpy.ops.ed.undo()
    pair = bpy.data.objects["Source"], bpy.data.objects["Target"]
    assert (carried(*pair) == before).all()
    assert not point_pairs.listed(*pair)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "pairs.blend"))
    pair = bpy.data.objects["Source"], bpy.data.objects["Target"]
    assert (carried(*pair) == after).all()
    assert [x.followed for x in point_pairs.listed(*pair)] == [True]
    assert bpy.ops.mobius.remove_pair("EXEC_DEFAULT", True) == {"FINISHED"}
    assert (carried(*pair) == before).all()


def test_aligning_again_leaves_pairs_to_be_applied(aligned):
    source, target = aligned
    add(source, target, vertex_at(target, 0.3, 0.2), follow_all=True)
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert not target.data.mobius_alignment.unbent
    assert [pair.followed for pair in point_pairs.listed(source, target)] == [None]


def test_empties_made_by_hand_are_pairs(aligned):
    source, target = aligned
    vertex = vertex_at(target, 0.3, 0.2)
    goal = carried(*aligned)[vertex] + [0.05, 0, 0]
    for obj, place in ((source, goal), (target, positions(target)[vertex])):
        empty = bpy.data.objects.new("nose", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.parent, empty.location = obj, place
    bpy.context.view_layer.update()
    assert [pair.name for pair in point_pairs.listed(source, target)] == ["nose"]
    assert bpy.ops.mobius.bend_through_pairs(follow_all=True) == {"FINISHED"}
    assert np.linalg.norm(carried(*aligned)[vertex, :2] - goal[:2]) < 0.01
    assert bpy.ops.mobius.select_pair(pair="nose") == {"FINISHED"}
    assert {obj.name for obj in bpy.context.selected_objects} == {"nose", "nose.001"}


def test_a_stale_map_takes_no_pair(aligned):
    source, target = aligned
    target.data.vertices[0].co.x += 0.5
    target.data.update()
    with pytest.raises(RuntimeError, match="has been edited since"):
        bpy.ops.mobius.add_pair("EXEC_DEFAULT", source_point=(0, 0, 0), target_point=(0, 0, 0))
    assert not point_pairs.listed(source, target)


def test_swapping_keeps_the_map_the_other_way(aligned):
    source, target = aligned
    there = carried(*aligned)
    assert bpy.ops.mobius.swap("EXEC_DEFAULT", True) == {"FINISHED"}
    settings = bpy.context.scene.mobius
    assert (settings.source, settings.target) == (target, source)
    assert stored_alignment.pair(bpy.context) == (target, source)
    back = carried(target, source)
    # there and back, by the nearest vertex: within a square of the sheet
    inside = np.abs(positions(target)[:, :2]).max(axis=1) < 0.8
    for vertex in np.flatnonzero(inside):
        near = np.linalg.norm(positions(source) - there[vertex], axis=1).argmin()
        assert np.linalg.norm(back[near] - positions(target)[vertex]) < 0.15
    figures = stored_alignment.figures(source)
    assert figures["source"] == "Target"
    assert figures["coverage"] > 0.8
    assert bpy.ops.mobius.swap() == {"FINISHED"}
    assert (carried(*aligned) == there).all()


def test_swapping_a_stale_pair_says_that_the_map_is_lost(aligned):
    source, target = aligned
    target.data.vertices[0].co.x += 0.5
    target.data.update()
    assert bpy.ops.mobius.swap() == {"FINISHED"}
    assert not source.data.mobius_alignment.target_fingerprint
