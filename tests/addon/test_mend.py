"""The mesh itself is mended when a person asks for it, by Blender's own operators, and by nothing else."""

from typing import Any

import numpy as np
import pytest
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.mobius_addon.operators.mend import REMEDIES  # noqa: E402
from mobius_extension.mobius_addon.options import repair  # noqa: E402
from mobius_extension.mobius_addon.topology_cache import line_of  # noqa: E402
from mobius_extension.solver import topology  # noqa: E402


def sheet(keep: Any = None, change: Any = None, n: int = 12) -> Any:
    """A sheet, the active object, of which only some faces are kept, with a group and a shape key."""
    obj = make_sheet("Sheet", n, keep=keep) if keep else make_sheet("Sheet", n)
    obj.vertex_groups.new(name="Group").add([0, 1, n + 1], 0.5, "REPLACE")
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Smile").data[0].co.z += 1
    if change:
        change(obj.data)
        obj.data.update()
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.ed.undo_push(message="before")
    return obj


def edits(obj: Any) -> tuple[str, ...]:
    return line_of(obj, repair(bpy.context.scene.mobius)).edits


def found(obj: Any) -> Any:
    return topology(read_surface(obj).mesh)


def mend(obj: Any, how: str) -> set[str]:
    """Mend, which keeps mode, selection and what is on the mesh."""
    done = bpy.ops.mobius.mend("EXEC_DEFAULT", True, object_name=obj.name, how=how)
    assert bpy.context.mode == "OBJECT"
    assert (bpy.context.object, bpy.context.selected_objects) == (obj, [obj])
    assert obj.vertex_groups.keys() == ["Group"]
    assert obj.data.shape_keys.key_blocks.keys() == ["Basis", "Smile"]
    return done


def test_a_clean_mesh_is_offered_nothing() -> None:
    assert edits(sheet()) == ()


def test_openings_are_filled_but_the_rim() -> None:
    obj = sheet(lambda i, j: ((i - 5) ** 2 + (j - 5) ** 2 > 2) & ((i != 9) | (j != 9)))
    assert "fill" in edits(obj)
    assert len(found(obj).boundary_loops) == 3
    assert mend(obj, "fill") == {"FINISHED"}
    assert len(found(obj).boundary_loops) == 1
    assert mend(obj, "fill") == {"CANCELLED"}
    bpy.ops.ed.undo()
    assert len(found(bpy.data.objects["Sheet"]).boundary_loops) == 3


def test_the_largest_part_is_kept() -> None:
    obj = sheet(lambda i, j: j != 3)
    assert {"largest"} <= set(edits(obj))
    assert found(obj).parts == 2
    assert mend(obj, "largest") == {"FINISHED"}
    assert found(obj).parts == 1
    assert len(obj.data.polygons) == 11 * 7


def test_what_is_cut_is_joined_and_what_has_a_seam_is_cut() -> None:
    obj = sheet()
    with pytest.raises(RuntimeError, match="mark the edges to cut along"):
        mend(obj, "cut")
    vertices = np.array([tuple(edge.vertices) for edge in obj.data.edges])
    across = (vertices // 12 == 6).all(axis=1)
    obj.data.edges.foreach_set("use_seam", across)
    assert mend(obj, "cut") == {"FINISHED"}
    assert len(obj.data.vertices) == 12 * 13
    assert found(obj).parts == 2
    assert mend(obj, "join") == {"FINISHED"}
    assert len(obj.data.vertices) == 12 * 12
    assert found(obj).is_disc


def test_faces_are_turned_and_inner_ones_deleted() -> None:
    obj = sheet(change=lambda mesh: [mesh.polygons[k].flip() for k in (30, 31, 50)])
    assert "normals" in edits(obj)
    assert mend(obj, "normals") == {"FINISHED"}
    assert len(found(obj).inconsistent_edges) == 0
    before = obj.data.polygons[0].normal.z
    assert mend(obj, "flip") == {"FINISHED"}
    assert obj.data.polygons[0].normal.z == -before
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=1)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh, faces = cube.data, [tuple(x.vertices) for x in cube.data.polygons]
    points = np.array([v.co[:] for v in mesh.vertices])
    ring = [k for k in range(len(points)) if abs(points[k, 2]) < 0.1 and np.abs(points[k, :2]).max() > 0.9]
    ring.sort(key=lambda k: np.arctan2(points[k, 1], points[k, 0]))
    mesh.clear_geometry()
    mesh.from_pydata(points, [], [*faces, tuple(ring)])
    assert "inner" in edits(cube)
    assert bpy.ops.mobius.mend("EXEC_DEFAULT", True, object_name=cube.name, how="inner") == {"FINISHED"}
    assert len(found(cube).non_manifold_edges) == 0
    assert len(cube.data.polygons) == len(faces)


@pytest.mark.parametrize("how", ["fill", "join", "largest", "inner"])
def test_where_nothing_is_to_be_mended_the_selection_stays(how: str) -> None:
    obj = sheet()
    chosen = [vertex.index % 3 == 0 for vertex in obj.data.vertices]
    edges = [edge.index % 5 == 0 for edge in obj.data.edges]
    obj.data.vertices.foreach_set("select", chosen)
    obj.data.edges.foreach_set("select", edges)
    assert mend(obj, how) == {"CANCELLED"}
    assert [vertex.select for vertex in obj.data.vertices] == chosen
    assert [edge.select for edge in obj.data.edges] == edges


def test_nothing_is_done_to_what_cannot_be_edited() -> None:
    obj = sheet(lambda i, j: j != 3)
    bpy.context.scene.collection.objects.unlink(obj)
    other = bpy.data.collections.new("Out of View")
    other.objects.link(obj)
    bpy.context.scene.collection.children.link(other)
    bpy.context.view_layer.layer_collection.children["Out of View"].exclude = True
    before = len(obj.data.vertices)
    with pytest.raises(RuntimeError, match="is in no collection of this view layer"):
        bpy.ops.mobius.mend(object_name=obj.name, how="largest")
    assert len(obj.data.vertices) == before
    assert {x.identifier for x in REMEDIES} == {"fill", "join", "largest", "inner", "cut", "normals", "flip"}


def test_what_is_in_the_way_is_told_from_what_is_mended_anyway() -> None:
    obj = sheet(lambda i, j: j != 3)
    settings = bpy.context.scene.mobius
    assert line_of(obj, repair(settings)).is_disc
    settings.largest_part = False
    line = line_of(obj, repair(settings))
    assert (line.is_disc, line.remedy, line.edits[0]) == (False, "largest_part", "largest")
    assert mend(obj, "largest") == {"FINISHED"}
    assert line_of(obj, repair(settings)).is_disc


@pytest.mark.parametrize("pinned", [False, True])
def test_what_meets_in_the_active_shape_alone_is_not_joined(pinned: bool) -> None:
    """As closed lids do."""
    obj = sheet()
    closed = obj.data.shape_keys.key_blocks["Smile"]
    closed.points[15].co = closed.points[14].co
    obj.active_shape_key_index, obj.show_only_shape_key = 1, pinned
    shape = [point.co[:] for point in closed.points]
    assert mend(obj, "join") == {"CANCELLED"}
    assert len(obj.data.vertices) == 12 * 12
    assert (obj.active_shape_key_index, obj.show_only_shape_key) == (1, pinned)
    assert [point.co[:] for point in obj.data.shape_keys.key_blocks["Smile"].points] == shape


def test_faces_that_are_hidden_are_not_left_behind() -> None:
    obj = sheet()
    for polygon in obj.data.polygons[:10]:
        polygon.hide = True
    upwards = [polygon.normal.z > 0 for polygon in obj.data.polygons]
    for remedy in REMEDIES:
        if remedy.identifier != "cut":  # there is no seam
            with pytest.raises(RuntimeError, match="hidden in part"):
                mend(obj, remedy.identifier)
    assert [polygon.normal.z > 0 for polygon in obj.data.polygons] == upwards
    assert [polygon.hide for polygon in obj.data.polygons[:11]] == [True] * 10 + [False]
    for polygon in obj.data.polygons:
        polygon.hide = False
    assert mend(obj, "flip") == {"FINISHED"}
    assert [polygon.normal.z < 0 for polygon in obj.data.polygons] == upwards


@pytest.mark.parametrize("how", [x.identifier for x in REMEDIES])
def test_another_mesh_in_edit_mode_is_not_mended_along(how: str) -> None:
    """Blender's tools of Edit Mode work on all that are in it: the other's selected vertices would be deleted."""
    obj = sheet(lambda i, j: (i, j) != (5, 5) and j != 8)
    obj.data.edges[0].use_seam = True
    other = make_sheet("Other", 6)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.view_layer.objects.active = obj
    assert bpy.context.mode == "OBJECT"
    with pytest.raises(RuntimeError, match="'Other' is in Edit Mode: switch to Object Mode first"):
        bpy.ops.mobius.mend(object_name=obj.name, how=how)
    assert (other.mode, obj.mode) == ("EDIT", "OBJECT")
    other.update_from_editmode()
    assert len(other.data.vertices) == 36
    assert bpy.ops.mobius.check(object_name=obj.name, edit=True) == {"FINISHED"}
    assert (other.mode, obj.mode) == ("EDIT", "OBJECT")
