"""Several targets as one job: each is written, what fails is named, and one undo takes all back."""

import numpy as np
import pytest
from scenes import QUICK, corner_values, make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.job import Job  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402


def choose(source, *targets) -> None:
    bpy.context.scene.mobius.source = source
    for obj in bpy.context.scene.objects:
        obj.select_set(obj in (source, *targets))


def test_all_selected_targets_share_the_layout_of_the_source() -> None:
    source, first, second, other = (make_sheet(name, n) for name, n in (("S", 15), ("A", 11), ("B", 12), ("C", 9)))
    choose(source, first, second)
    assert bpy.ops.mobius.align_selected(**QUICK) == {"FINISHED"}
    layout = source.data.uv_layers.active
    assert layout is not None
    places = {}
    for obj in (source, first, second):
        uv = corner_values(obj, layout.name)
        corner = np.array([obj.data.vertices[loop.vertex_index].co[:2] for loop in obj.data.loops])
        places[obj.name] = corner, uv
    # the same place of the sheet is at the same place of the layout
    for name in ("A", "B"):
        assert stored_alignment.exists(bpy.data.objects[name], source)
        corner, uv = places[name]
        apart = np.linalg.norm(corner[:, None] - places["S"][0], axis=2)
        error = np.linalg.norm(uv - places["S"][1][apart.argmin(axis=1)], axis=1)
        assert np.median(error[apart.min(axis=1) < 0.04]) < 0.06
    assert not stored_alignment.exists(other, source)
    assert Job.current is None


def test_one_that_cannot_be_aligned_does_not_stop_the_others(capfd: pytest.CaptureFixture[str]) -> None:
    source, target = make_sheet("S", 15), make_sheet("A", 11)
    bpy.ops.mesh.primitive_ico_sphere_add()
    ball = bpy.context.object
    choose(source, ball, target)
    assert bpy.ops.mobius.align_selected(**QUICK) == {"FINISHED"}
    assert stored_alignment.exists(target, source)
    assert not stored_alignment.exists(ball, source)
    out = capfd.readouterr().out
    report = stored_alignment.figures(target)
    level = report["verdict"].title()
    assert f"'S' → 'A': {level}: {report['coverage']:.0%} matched; Mean error about" in out
    assert f"'S' is aligned with 1 of 2 meshes: {level}: 1" in out
    choose(source, ball)
    with pytest.raises(RuntimeError, match="None of the selected meshes"):
        bpy.ops.mobius.align_selected(**QUICK)


def test_without_a_target_it_says_what_to_select() -> None:
    source = make_sheet("S", 8)
    choose(source)
    with pytest.raises(RuntimeError, match="Select the meshes that 'S' is to be aligned with"):
        bpy.ops.mobius.align_selected(**QUICK)


def test_the_piece_that_a_group_names_is_what_is_matched() -> None:
    source, target = make_sheet("S", 15), make_sheet("A", 11)
    right = [vertex.index for vertex in target.data.vertices if vertex.co.x > -0.1]
    target.vertex_groups.new(name="Right").add(right, 1.0, "REPLACE")
    choose(source, target)
    with pytest.raises(RuntimeError, match="Nothing"):
        bpy.ops.mobius.align_selected(**QUICK, target_cut="Nothing")
    bpy.ops.mobius.align_selected(**QUICK, target_cut="Right")
    found = stored_alignment.load(target, source, (read_surface(source), read_surface(target)))
    known = np.flatnonzero(found.face >= 0)
    assert len(known) > len(right) / 2
    assert set(known) <= set(right)


def test_the_results_are_listed_and_a_click_chooses_one() -> None:
    from mobius_extension.mobius_addon.panel import targets

    source, first, second = (make_sheet(name, n) for name, n in (("S", 15), ("A", 11), ("B", 12)))
    assert not targets.MOBIUS_PT_targets.poll(bpy.context)
    choose(source, first, second)
    bpy.ops.mobius.align_selected(**QUICK)
    listed = {row.obj.name: row for row in targets.rows(bpy.context)}
    assert set(listed) == {"A", "B"}
    assert targets.MOBIUS_PT_targets.poll(bpy.context)
    for name, row in listed.items():
        report = stored_alignment.figures(bpy.data.objects[name])
        assert report is not None
        assert (row.level, row.coverage, row.warnings) == (
            report["verdict"],
            report["coverage"],
            len(report["warnings"]),
        )
    assert bpy.ops.mobius.choose_target(object_name="B") == {"FINISHED"}
    assert bpy.context.scene.mobius.target == second
    assert [obj.name for obj in bpy.context.selected_objects] == ["B"]
    assert bpy.context.object == second
    with pytest.raises(RuntimeError, match="There is no mesh 'C'"):
        bpy.ops.mobius.choose_target(object_name="C")
    # what was edited comes first and says so; what is damaged too
    second.data.vertices[0].co.x += 1
    first.data.mobius_alignment.report = "{"
    bpy.context.view_layer.update()
    assert [(row.obj.name, row.level) for row in targets.rows(bpy.context)] == [("A", "damaged"), ("B", "edited")]
    last = bpy.context.window_manager.operator_properties_last("mobius.choose_target")
    assert "Make this mesh the target" in bpy.types.MOBIUS_OT_choose_target.description(bpy.context, last)
