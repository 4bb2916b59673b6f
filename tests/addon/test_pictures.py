"""What is shown of an alignment: heat maps, matched points, the two discs, and both meshes side by side."""

import itertools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import QUICK, bumps, everything, make_sheet, positions
from scipy.spatial.transform import Rotation

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import overlay, results  # noqa: E402
from mobius_extension.mobius_addon.attributes import OWN_NAMES, PATTERN_COLOR  # noqa: E402
from mobius_extension.mobius_addon.comparison import COLLECTION  # noqa: E402
from mobius_extension.mobius_addon.heat_maps import (  # noqa: E402
    DISC_MEASURES,
    LARGEST_FACTOR,
    MAP_MEASURES,
    Measure,
    shown_by,
    vertex_dilatations,
)
from mobius_extension.mobius_addon.overlay import legend  # noqa: E402
from mobius_extension.mobius_addon.overlay.matches import chosen_matches, hues  # noqa: E402
from mobius_extension.solver import Correspondence, TriangleMesh  # noqa: E402

ACCURATE = QUICK | {"samples": 40, "targets": 300, "refine": "mobius"}


@pytest.fixture
def aligned(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    bpy.ops.mobius.align(**ACCURATE)
    return pair


def colors(obj: Any, name: str) -> np.ndarray:
    return np.array([value.color[:] for value in obj.data.color_attributes[name].data])


# heat maps


def plane(n: int, matrix: np.ndarray) -> TriangleMesh:
    """A square grid in the plane, moved by a linear map into space, (3, 2)."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n)))
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    return TriangleMesh(np.stack([x, y], axis=1) @ matrix.T, np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]), "Plane")


def identity(mesh: TriangleMesh, confidence: np.ndarray) -> Correspondence:
    """Vertex i of one mesh to vertex i of another with the same triangles."""
    n = len(mesh.vertices)
    face, corner = np.zeros(n, int), np.zeros(n, int)
    for k in range(3):
        face[mesh.faces[:, k]], corner[mesh.faces[:, k]] = np.arange(len(mesh.faces)), k
    return Correspondence(face, np.eye(3)[corner], confidence >= 0.5, confidence, mesh.faces, n)


def test_the_distortion_of_a_map_between_surfaces() -> None:
    turned = Rotation.from_rotvec((0.3, -0.7, 1.1)).as_matrix()[:, :2]
    source, target = plane(5, turned @ np.diag([3.0, 2.0])), plane(5, turned[::-1])
    found = identity(target, np.linspace(0, 1, 25))
    confidence, angles, sizes = (measure.shares(found, source, target) for measure in MAP_MEASURES)
    assert confidence == pytest.approx(np.linspace(0, 1, 25))
    # stretched by 3 and 2: the dilatation is 1.5, and everywhere the same size
    assert vertex_dilatations(target, found.matrix() @ source.vertices) == pytest.approx(1.5)
    assert angles == pytest.approx(np.log(1.5) / np.log(2))
    assert sizes == pytest.approx(0.5)
    # a map that enlarges one half by 2 in both directions is conformal there, and the colors say by how much
    bent = target.vertices.copy()
    first, flat = np.linspace(0, 1, 5), plane(5, np.eye(3)[:, :2])
    x = np.interp(flat.vertices[:, 0], first, [0, 0.25, 0.5, 1.0, 1.5])
    bent = np.c_[x, flat.vertices[:, 1:]]
    shares = MAP_MEASURES[2].shares(identity(flat, np.ones(25)), TriangleMesh(bent, flat.faces, "Bent"), flat)
    inner = shares.reshape(5, 5)[:, [1, 3]]
    assert inner[:, 1] - inner[:, 0] == pytest.approx(0.25 * np.log(2) / np.log(LARGEST_FACTOR))


def test_vertices_without_a_counterpart_have_no_color() -> None:
    mesh = plane(3, np.eye(3)[:, :2])
    lonely = TriangleMesh(np.concatenate([mesh.vertices, [[9.0, 9, 9]]]), mesh.faces, "Lonely")
    found = identity(mesh, np.ones(9))
    found = Correspondence(
        np.append(found.face, -1),
        np.concatenate([found.barycentric, np.zeros((1, 3))]),
        np.append(found.matched, False),
        np.append(found.confidence, 0.0),
        mesh.faces,
        9,
    )
    for measure in MAP_MEASURES:
        assert measure.color(found, mesh, lonely)[1].tolist() == [True] * 9 + [False]


@pytest.mark.parametrize("measure", MAP_MEASURES, ids=lambda measure: measure.identifier)
def test_heat_maps_are_color_attributes_of_the_target(aligned: tuple[Any, Any], measure: Measure) -> None:
    source, target = aligned
    before = everything(source)
    assert bpy.ops.mobius.heat_map(measure=measure.identifier) == {"FINISHED"}
    assert target.data.attributes.active_color_name == measure.attribute
    assert np.isfinite(colors(target, measure.attribute)).all()
    assert everything(source) == before
    assert shown_by(measure.attribute) is measure


def test_a_heat_map_needs_an_alignment_that_is_not_stale(aligned: tuple[Any, Any]) -> None:
    aligned[1].data.vertices[0].co.z += 0.1
    before = everything(aligned[1])
    for operator in (bpy.ops.mobius.heat_map, bpy.ops.mobius.side_by_side):
        with pytest.raises(RuntimeError, match="'Target' has been edited since it was aligned"):
            operator()
    assert everything(aligned[1]) == before


def test_what_is_only_to_be_looked_at_is_not_carried(aligned: tuple[Any, Any]) -> None:
    for measure in MAP_MEASURES:
        bpy.ops.mobius.heat_map(measure=measure.identifier)
    for measure in (*MAP_MEASURES, *DISC_MEASURES):
        assert measure.attribute in OWN_NAMES
    bpy.ops.mobius.swap()
    bpy.ops.mobius.align(**QUICK)
    with pytest.raises(RuntimeError, match="has no color attributes to transfer"):
        bpy.ops.mobius.transfer(kinds={"COLORS"})


# matched points


def test_lines_join_corresponding_points(aligned: tuple[Any, Any]) -> None:
    found = overlay.matches_of(*aligned, 50)
    assert found is not None
    assert len(found.source) == len(found.target) == len(found.layout) == 50
    # both are the same surface in the same place; points are lifted a little
    assert np.abs(found.source - found.target).max() < 0.15
    assert np.abs(found.source - found.target).mean() < 0.05
    # in the layout the points lie where the target's vertices do
    placed = results.read_layout(aligned[1])
    assert placed is not None
    where = np.array([np.abs(positions(aligned[1]) - point).sum(axis=1).argmin() for point in found.target])
    assert found.layout[:, 0] == pytest.approx(placed.disc[where].real / 2 + 0.5, abs=1e-6)
    assert overlay.matches_of(*aligned, 10**6).target.shape[0] <= 256  # type: ignore[union-attr]


def test_no_lines_once_a_mesh_was_edited(aligned: tuple[Any, Any]) -> None:
    aligned[0].data.vertices[0].co.z += 0.1
    assert overlay.matches_of(*aligned, 50) is None


def test_points_are_remembered_until_an_edit(aligned: tuple[Any, Any]) -> None:
    first = chosen_matches(bpy.context)
    assert first is not None
    assert chosen_matches(bpy.context) is first
    bpy.context.window_manager.mobius_view.count = 20
    assert len(chosen_matches(bpy.context).target) == 20
    bpy.context.window_manager.mobius_view.count = 200
    bpy.context.view_layer.objects.active = aligned[1]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(0, 0, 1))
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert chosen_matches(bpy.context) is None


# draw handlers


def test_handlers_are_there_only_while_something_is_drawn(aligned: tuple[Any, Any], tmp_path: Any) -> None:
    view = bpy.context.window_manager.mobius_view
    assert set(overlay._handles) == set()
    view.matches = True
    assert set(overlay._handles) == {"matches"}
    view.discs = True
    assert set(overlay._handles) == {"matches", "discs", "names"}
    view.matches = view.discs = False
    assert set(overlay._handles) == set()
    view.legend = True
    assert set(overlay._handles) == {"legend"}
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert set(overlay._handles) == set()
    assert not bpy.context.window_manager.mobius_view.legend


def test_unregistering_removes_the_handlers() -> None:
    import mobius_extension

    bpy.context.window_manager.mobius_view.matches = True
    mobius_extension.unregister()
    assert overlay._handles == {}
    mobius_extension.register()


def test_the_legend_tells_what_is_shown(aligned: tuple[Any, Any]) -> None:
    shading = SimpleNamespace(type="SOLID", color_type="VERTEX")
    view = SimpleNamespace(legend=True)
    context: Any = SimpleNamespace(
        space_data=SimpleNamespace(shading=shading),
        window_manager=SimpleNamespace(mobius_view=view),
        object=aligned[0],
        scene=bpy.context.scene,
    )
    assert overlay.legends(context) == []
    bpy.ops.mobius.heat_map(measure="factor")
    assert [x.identifier for x in overlay.legends(context)] == ["factor"]
    shading.color_type = "MATERIAL"  # the colors are not seen
    assert overlay.legends(context) == []


@given(
    count=st.integers(1, 3),
    width=st.floats(50, 3000),
    height=st.floats(50, 2000),
    scale=st.sampled_from([1.0, 1.5, 2.0]),
)
def test_legends_stay_on_screen_and_apart(count: int, width: float, height: float, scale: float) -> None:
    room = 70.0, 20.0, width, height
    found = legend.corners(count, *room, scale)
    boxes = [(x, y, x + wide, y + legend.HEIGHT * scale) for x, y, wide in found]
    for left, bottom, right, top in boxes:
        assert room[0] <= left < right <= room[2] + 1e-9
        assert room[1] <= bottom < top <= room[3] + 1e-9
    for one, two in itertools.combinations(boxes, 2):
        assert one[2] <= two[0] or two[2] <= one[0] or one[3] <= two[1] or two[3] <= one[1]
    if width >= 70 + 180 * scale and height >= 20 + (3 * 48 + 2 * 16) * scale:
        assert len(found) == count


# side by side


def test_side_by_side_shows_copies_in_one_pose(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    target.matrix_world = source.matrix_world.copy()
    target.rotation_euler, target.location, target.scale = (0.5, 1.0, -2.0), (7, 8, 9), (2, 2, 2)
    bpy.context.view_layer.update()
    before = [obj.matrix_world.copy() for obj in aligned]
    shapes = positions(source).tolist(), positions(target).tolist()
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert [obj.matrix_world for obj in aligned] == before
    assert (positions(source).tolist(), positions(target).tolist()) == shapes
    left, right = bpy.data.collections[COLLECTION].objects
    assert (left.data, right.data) == (source.data, target.data)
    bpy.context.view_layer.update()
    boxes = [np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices]) for obj in (left, right)]
    # beside each other in the front view, not over each other, at the same height and size
    assert boxes[0][:, 0].max() < boxes[1][:, 0].min() < boxes[0][:, 0].max() + 1
    assert np.abs(boxes[0].mean(axis=0) - boxes[1].mean(axis=0))[1:].max() < 0.05
    assert np.abs(np.ptp(boxes[0], axis=0) - np.ptp(boxes[1], axis=0)).max() < 0.1
    for obj in aligned:
        assert obj.data.attributes.active_color_name == PATTERN_COLOR
    # the pattern is carried: where the sheets coincide, the colors do
    seen = [colors(obj, PATTERN_COLOR)[np.abs(positions(obj)[:, :2]).max(axis=1) < 0.9] for obj in aligned]
    assert np.abs(seen[0].mean(axis=0) - seen[1].mean(axis=0)).max() < 0.05
    # again: replaced, not added
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert len(bpy.data.collections[COLLECTION].objects) == 2
    assert bpy.ops.mobius.end_side_by_side() == {"FINISHED"}
    assert sorted(obj.name for obj in bpy.data.objects) == ["Source", "Target"]
    assert COLLECTION not in bpy.data.collections
    assert bpy.context.object == target
    assert not bpy.ops.mobius.end_side_by_side.poll()


def test_what_was_selected_before_is_so_again_and_nobody_works_on_copies(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    other = make_sheet("Other", 3)
    for obj in (source, other, target):
        obj.select_set(obj != target)
    bpy.context.view_layer.objects.active = other
    bpy.ops.mobius.side_by_side()
    left, right = bpy.context.selected_objects
    assert {left.data, right.data} == {source.data, target.data}
    assert not bpy.ops.mobius.use_selected.poll()
    bpy.ops.mobius.transfer(kinds={"UV"})  # the copies show it too, and are nobody's other objects
    assert target.data.mobius_transferred
    assert "shares its mesh" not in target.data.mobius_transferred
    settings = bpy.context.scene.mobius
    settings.source = left
    with pytest.raises(RuntimeError, match="is a copy of Side by Side: choose the object that it shows"):
        bpy.ops.mobius.align()
    settings.source = source
    bpy.ops.mobius.side_by_side()
    other.name = "Renamed"
    bpy.ops.mobius.end_side_by_side()
    assert bpy.context.selected_objects == [source]
    assert bpy.context.object is None


def test_a_mirrored_copy_is_shown_mirrored() -> None:
    source, target = make_sheet("Source", 15), make_sheet("Target", 13, lambda x, y: bumps(-x, y))
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    bpy.ops.mobius.align(**ACCURATE | {"reflect": "always"})
    bpy.ops.mobius.side_by_side()
    left, right = bpy.data.collections[COLLECTION].objects
    bpy.context.view_layer.update()
    assert right.name == "Target (side by side, mirrored)"
    assert left.matrix_world.determinant() > 0 > right.matrix_world.determinant()
    # which has every bump on the same side as the source
    there = np.array([right.matrix_world @ vertex.co for vertex in target.data.vertices])
    there -= (there.min(axis=0) + there.max(axis=0)) / 2
    assert np.abs(there[:, 2] - there[:, 2].min() - bumps(there[:, 0], there[:, 1])).max() < 0.05


def test_matched_points_have_colors_of_their_own() -> None:
    places = np.random.default_rng(2).normal(size=(20, 3)) * (3, 2, 0.1)
    found = hues(places)
    assert found.shape == (20, 3)
    assert (found.min() >= 0, found.max() <= 1) == (True, True)
    apart = np.linalg.norm(found[:, None] - found, axis=2)[np.triu_indices(20, 1)]
    assert apart.min() > 0.2
    assert hues(places[:1]).shape == (1, 3)


def test_one_undo_takes_back_side_by_side(aligned: tuple[Any, Any]) -> None:
    bpy.ops.ed.undo_push(message="before")
    before = [str(everything(obj)) for obj in aligned]
    bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    assert [str(everything(bpy.data.objects[name])) for name in ("Source", "Target")] == before
    assert sorted(obj.name for obj in bpy.data.objects) == ["Source", "Target"]


def test_the_discs_need_a_window(aligned: tuple[Any, Any]) -> None:
    with pytest.raises(RuntimeError, match="Blender runs without a window"):
        bpy.ops.mobius.show_discs()


def test_a_layout_leaves_out_what_has_no_place(pair: tuple[Any, Any]) -> None:
    parts = make_sheet("Parts", 16, keep=lambda i, j: j != 2)
    bpy.context.scene.mobius.target = parts
    bpy.ops.mobius.align(**QUICK, largest_part=True)
    found = results.read_layout(parts)
    assert found is not None
    column = np.arange(256) % 16
    assert (np.isnan(found.disc.real) == (column <= 2)).all()
    assert (column[found.edges] > 2).all()
    assert np.abs(found.disc[column > 2]).max() < 1 + 1e-6
