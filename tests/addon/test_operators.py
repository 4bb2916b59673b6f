"""The operators: what each does, what each refuses, and that one undo takes it back."""

from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, everything, make_object, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import stored_alignment, topology_cache  # noqa: E402
from mobius_extension.mobius_addon.computation import Repair  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, read_surface  # noqa: E402
from mobius_extension.mobius_addon.operators.align import as_read  # noqa: E402
from mobius_extension.mobius_addon.usable import why_not  # noqa: E402


def activate(obj: Any) -> None:
    bpy.context.view_layer.objects.active = obj


def closed_cube() -> Any:
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return make_object("Bad", corners, quads)


BAD_MESHES = {
    "closed": (closed_cube, "'Bad' is closed"),
    "parts": (lambda: make_sheet("Bad", 7, keep=lambda i, j: j != 2), "'Bad' has 2 separate parts"),
    "loops": (lambda: make_sheet("Bad", 6, keep=lambda i, j: (i, j) != (2, 2)), "'Bad' has 2 boundary loops"),
    "edges": (
        lambda: make_object(
            "Bad", [(0, 0, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1)], [(0, 1, 2), (1, 0, 3), (0, 1, 4)]
        ),
        "'Bad' has 1 edge in three or more faces",
    ),
    "points": (
        lambda: make_sheet("Bad", 5, keep=lambda i, j: (i < 2) == (j < 2)),
        "'Bad' has 2 separate parts",  # which touch in a point
    ),
    "no faces": (lambda: make_object("Bad", [(0, 0, 0), (1, 0, 0)], []), "'Bad' has no faces"),
    "empty": (lambda: make_object("Bad", [], []), "'Bad' has no vertices"),
    "nan": (
        lambda: make_object("Bad", [(0, 0, 0), (1, 0, 0), (0, float("nan"), 0)], [(0, 1, 2)]),
        "'Bad' has 1 vertex whose position is not a finite number",
    ),
}


@pytest.fixture(params=BAD_MESHES)
def bad_mesh(request: pytest.FixtureRequest) -> tuple[Any, str]:
    make, reason = BAD_MESHES[request.param]
    return make(), reason


# check


def test_check_says_disc_and_selects_nothing() -> None:
    obj = make_sheet("Sheet", 6)
    before = everything(obj)
    assert bpy.ops.mobius.check() == {"FINISHED"}
    assert everything(obj) == before
    assert topology_cache.line_of(obj, Repair()) == topology_cache.Line(("disc, 36 vertices",), True)


@pytest.mark.parametrize(
    ("name", "selected"),
    [("parts", [0, 1, 2, 7, 8, 9]), ("loops", [14, 15, 20, 21]), ("edges", [0, 1]), ("points", [12])],
)
def test_check_selects_the_trouble(name: str, selected: list[int]) -> None:
    obj = BAD_MESHES[name][0]()
    assert bpy.ops.mobius.check() == {"FINISHED"}
    found = [vertex.index for vertex in obj.data.vertices if vertex.select]
    assert set(selected) <= set(found)
    if name == "parts":  # the smaller one: two columns of quads against three
        assert {index % 7 for index in found} == {0, 1, 2}
    else:
        assert found == selected
    # what is selected survives Edit Mode, in the select mode that was set
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [vertex.index for vertex in obj.data.vertices if vertex.select] == found


def test_check_can_name_another_object_than_the_active_one() -> None:
    hole = make_sheet("Hole", 6, keep=lambda i, j: (i, j) != (2, 2))
    make_sheet("Active", 4)
    assert bpy.ops.mobius.check(object_name="Hole") == {"FINISHED"}
    assert sum(vertex.select for vertex in hole.data.vertices) == 4
    with pytest.raises(RuntimeError, match="there is no object 'Gone'"):
        bpy.ops.mobius.check(object_name="Gone")


# flatten


def test_flatten_writes_the_disc_as_the_active_uv_map() -> None:
    obj = make_sheet("Sheet", 9)
    obj.data.uv_layers.new(name="UVMap")
    assert bpy.ops.mobius.flatten() == {"FINISHED"}
    assert obj.data.uv_layers.active.name == "Mobius Disc"
    assert [layer.name for layer in obj.data.uv_layers if layer.active_render] == ["UVMap"]
    disc = (corner_values(obj, "Mobius Disc") - 0.5) * 2
    radius = np.hypot(*disc.T)
    corner_vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    rim = (np.abs(positions(obj)[:, :2]).max(axis=1) == 1)[corner_vertex]
    assert np.allclose(radius[rim], 1, atol=1e-6)
    assert (radius[~rim] < 1).all()
    # one place per vertex, and every polygon the right way up
    for vertex in range(81):
        assert np.ptp(disc[corner_vertex == vertex], axis=0).max() == 0
    for polygon in obj.data.polygons:
        x, y = disc[list(polygon.loop_indices)].T
        assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0
    assert bpy.ops.mobius.flatten() == {"FINISHED"}  # again: replaced, not added
    assert len(obj.data.uv_layers) == 2


def test_a_mirrored_object_has_the_mirrored_disc() -> None:
    obj = make_sheet("Sheet", 9)
    bpy.ops.mobius.flatten()
    plain = corner_values(obj, "Mobius Disc")
    obj.scale.x = -1
    bpy.context.view_layer.update()
    bpy.ops.mobius.flatten()
    mirrored = corner_values(obj, "Mobius Disc")
    a, b = ((uv[:, 0] - 0.5) + 1j * (uv[:, 1] - 0.5) for uv in (plain, np.array(mirrored)))
    turn = np.vdot(np.conj(a), b)
    assert np.allclose(np.conj(a) * turn / abs(turn), b, atol=1e-4)


def test_flatten_refuses_what_is_no_disc_and_writes_nothing(bad_mesh: tuple[Any, str]) -> None:
    obj, reason = bad_mesh
    before = everything(obj)
    with pytest.raises(RuntimeError, match=reason):
        bpy.ops.mobius.flatten(fill_holes=False, largest_part=False)
    assert str(everything(obj)) == str(before)  # as text: nan differs from itself


def test_flatten_needs_room_for_a_uv_map() -> None:
    obj = make_sheet("Sheet", 5)
    for number in range(8):
        obj.data.uv_layers.new(name=f"UV {number}")
    with pytest.raises(RuntimeError, match="'Sheet' has 8 UV maps"):
        bpy.ops.mobius.flatten()
    assert "Mobius Disc" not in obj.data.uv_layers


def test_a_foreign_attribute_under_our_name_is_not_overwritten() -> None:
    obj = make_sheet("Sheet", 5)
    obj.data.attributes.new("Mobius Disc", "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match="'Sheet' has something named 'Mobius Disc' that is no UV map: rename it"):
        bpy.ops.mobius.flatten()
    assert [x.name for x in obj.data.uv_layers] == []


# align


def test_nothing_is_written_on_what_was_deleted_meanwhile() -> None:
    """It is there as long as the scene points to it; what is written then is an undo step that nobody sees."""
    target = make_sheet("Target", 5)
    bpy.context.scene.mobius.target = target
    read = target.session_uid, target.name, read_surface(target)
    assert as_read(*read) == target
    bpy.ops.object.select_all(action="DESELECT")
    target.select_set(True)
    bpy.ops.object.delete()
    assert bpy.data.objects["Target"].session_uid == read[0]
    with pytest.raises(Refusal, match="'Target' was removed or is being edited since the alignment began"):
        as_read(*read)


def test_align_writes_on_both_meshes(pair: tuple[Any, Any]) -> None:
    source, target = pair
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    for obj in pair:
        assert "Mobius" in obj.data.uv_layers
        assert obj.data.color_attributes["Mobius Color"].domain == "POINT"
        assert obj.data.attributes.active_color_name == "Mobius Color"
        assert weights(obj, "Mobius Matched").max() > 0.5
    assert [layer.name for layer in source.data.uv_layers if layer.active_render] == ["UVMap"]
    assert source.vertex_groups.active.name == "Right"
    # corresponding points, here those at the same place, have the same UV and the same color
    uv, color = [], []
    for obj, n in ((source, 21), (target, 16)):
        per_corner = corner_values(obj, "Mobius")
        layout = np.zeros((n * n, 2))
        layout[[loop.vertex_index for loop in obj.data.loops]] = per_corner
        colors = np.array([value.color[:] for value in obj.data.color_attributes["Mobius Color"].data])
        grid = np.array([r * (n - 1) // 5 * n + c * (n - 1) // 5 for r in range(6) for c in range(6)])
        uv.append(layout[grid])
        color.append(colors[grid])
    assert np.abs(uv[0] - uv[1]).max() < 0.05
    assert np.abs(color[0] - color[1]).max() < 0.05


def test_align_tells_left_from_right_as_the_person_sees_it(pair: tuple[Any, Any]) -> None:
    _, target = pair
    target.scale.x = -1
    bpy.context.view_layer.update()
    errors = {}
    for reflect in ("always", "never"):
        assert bpy.ops.mobius.align(**QUICK | {"reflect": reflect}) == {"FINISHED"}
        assert target.data.mobius_alignment.reflected == (reflect == "always")
        bpy.ops.mobius.transfer()
        # in the mesh's own space it is the same surface still
        errors[reflect] = np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2).max()
    assert errors["always"] < 0.1 < errors["never"]


def test_align_stores_what_was_found_and_proved(pair: tuple[Any, Any]) -> None:
    _, target = pair
    bpy.ops.mobius.align(**QUICK)
    kept = target.data.mobius_alignment
    assert (kept.source_name, kept.source) == ("Source", None)
    assert kept.certified
    assert kept.upper_bound == pytest.approx(kept.value)
    assert 0 < kept.value <= QUICK["samples"]
    assert 0.5 < kept.coverage <= 1
    assert '"certified": true' in kept.report


def test_align_refuses_what_is_no_disc_and_writes_on_neither(pair: tuple[Any, Any], bad_mesh: tuple[Any, str]) -> None:
    source, _ = pair
    bad, reason = bad_mesh
    bpy.context.scene.mobius.target = bad
    before = str((everything(source), everything(bad)))
    with pytest.raises(RuntimeError, match=reason):
        bpy.ops.mobius.align(**QUICK, fill_holes=False, largest_part=False)
    assert str((everything(source), everything(bad))) == before


def test_align_names_everything_that_is_wrong_with_the_choice(pair: tuple[Any, Any]) -> None:
    source, target = pair
    settings = bpy.context.scene.mobius

    def refused(match: str) -> None:
        for operator in (bpy.ops.mobius.align, bpy.ops.mobius.transfer):
            assert not operator.poll()
            with pytest.raises(RuntimeError, match=match):
                operator()

    settings.source = None
    refused("Choose a source mesh first")
    settings.source = target
    refused("'Target' is both source and target: choose two objects")
    twin = bpy.data.objects.new("Twin", target.data)
    bpy.context.scene.collection.objects.link(twin)
    settings.source = twin
    refused("'Twin' and 'Target' share one mesh: make one single-user first")
    settings.source = empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    refused("'Empty' is no mesh")
    settings.source = source
    bpy.data.scenes.new("Other").collection.objects.link(source)
    bpy.context.scene.collection.objects.unlink(source)
    refused("'Source' is not in this scene")
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type = "COLLECTION"
    instance.instance_collection = collection = bpy.data.collections.new("Character")
    inner = bpy.data.objects.new("Inner", None)
    inner.instance_type, inner.instance_collection = "COLLECTION", bpy.data.collections.new("Part")
    collection.objects.link(inner)
    inner.instance_collection.objects.link(source)
    bpy.context.scene.collection.objects.link(instance)
    refused(r"'Instance' is a collection instance: select it and .* \(Object > Apply > Make Instances Real\)")
    settings.source = instance
    refused("'Instance' is a collection instance")
    settings.source = source
    bpy.context.scene.collection.objects.link(source)
    activate(target)
    bpy.ops.object.mode_set(mode="EDIT")
    refused("'Target' is in Edit Mode: switch to Object Mode first")
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    refused("'Target' is in Weight Paint Mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    settings.target = None
    refused("Choose a target mesh first")


def test_linked_meshes_are_only_read(tmp_path: Any) -> None:
    make_sheet("Library Sheet", 8)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (stored, wanted):
        wanted.objects = stored.objects
    linked = wanted.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    assert why_not(linked, "mesh", bpy.context.scene, writes=False) is None
    bpy.context.scene.mobius.source = make_sheet("Source", 8)
    bpy.context.scene.mobius.target = linked
    with pytest.raises(RuntimeError, match="'Library Sheet' is linked from another file: make it local first"):
        bpy.ops.mobius.align(**QUICK)
    activate(linked)
    with pytest.raises(RuntimeError, match="'Library Sheet' is linked from another file"):
        bpy.ops.mobius.flatten()
    assert bpy.ops.mobius.check() == {"FINISHED"}


def test_an_overridden_mesh_whose_layers_blender_drops_on_saving_is_refused(tmp_path: Any) -> None:
    make_sheet("Sheet", 8)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Sheet"]
    linked = wanted.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    own = linked.override_create(remap_local_usages=True)
    own.data.override_create(remap_local_usages=True)
    assert own.data.is_editable
    scene = bpy.context.scene
    scene.mobius.source, scene.mobius.target = make_sheet("Source", 8), own
    with pytest.raises(RuntimeError, match=r"'Sheet' is linked .* Make Local > Selected Objects and Data"):
        bpy.ops.mobius.align(**QUICK)
    activate(own)
    own.select_set(True)
    bpy.ops.object.make_local(type="SELECT_OBDATA")
    assert why_not(bpy.context.object, "mesh", scene) is None


# transfer


def test_transfer_carries_what_is_on_the_source(pair: tuple[Any, Any]) -> None:
    source, target = pair
    bpy.ops.mobius.align(**QUICK | {"refine": "mobius"})
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2).max() < 0.05
    flat = positions(target)[[loop.vertex_index for loop in target.data.loops], :2] / 2 + 0.5
    assert np.abs(corner_values(target, "UVMap") - flat).max() < 0.05
    # what align wrote is no content of the source
    assert sorted(group.name for group in target.vertex_groups) == ["Mobius Matched", "Right"]
    assert len(target.data.uv_layers) == 2
    assert source.data.uv_layers.keys() == ["UVMap", "Mobius"]


def test_transfer_carries_only_what_is_chosen(pair: tuple[Any, Any]) -> None:
    _, target = pair
    bpy.ops.mobius.align(**QUICK)
    bpy.ops.mobius.transfer(kinds={"UV"})
    assert "UVMap" in target.data.uv_layers
    assert "Right" not in target.vertex_groups
    before = everything(target)
    with pytest.raises(RuntimeError, match="'Source' has no color attributes to transfer"):
        bpy.ops.mobius.transfer(kinds={"COLORS"})
    with pytest.raises(RuntimeError, match="Choose at least one kind of data"):
        bpy.ops.mobius.transfer(kinds=set())
    assert everything(target) == before


def test_transfer_needs_an_alignment_of_this_pair(pair: tuple[Any, Any]) -> None:
    source, target = pair
    with pytest.raises(RuntimeError, match="'Target' has not been aligned with 'Source' yet: press Align first"):
        bpy.ops.mobius.transfer()
    bpy.ops.mobius.align(**QUICK)
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = target, source
    with pytest.raises(RuntimeError, match="'Source' has not been aligned with 'Target' yet"):
        bpy.ops.mobius.transfer()


@pytest.mark.parametrize("edited", [0, 1])
def test_transfer_notices_an_edit_since_the_alignment(pair: tuple[Any, Any], edited: int) -> None:
    _, target = pair
    bpy.ops.mobius.align(**QUICK)
    pair[edited].data.vertices[0].co.z += 0.01
    before = everything(target)
    name = pair[edited].name
    with pytest.raises(RuntimeError, match=f"'{name}' has been edited since it was aligned: press Align again"):
        bpy.ops.mobius.transfer()
    assert everything(target) == before


def test_an_alignment_is_saved_with_the_file_and_follows_renaming(pair: tuple[Any, Any], tmp_path: Any) -> None:
    pair[0].name, pair[1].name = "Renamed", "Other"
    bpy.ops.mobius.align(**QUICK)
    pair[0].name = "Once More"
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bpy.context.scene.mobius.source.name == "Once More"
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert "Right" in bpy.data.objects["Other"].vertex_groups


def test_a_damaged_alignment_is_a_sentence(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    pair[1].data.mobius_alignment.packed = pair[1].data.mobius_alignment.packed[:100]
    with pytest.raises(RuntimeError, match="'Target' keeps an alignment that is damaged: press Align again"):
        bpy.ops.mobius.transfer()


def test_stored_and_loaded_correspondences_are_equal(pair: tuple[Any, Any]) -> None:
    from mobius_extension.mobius_addon.mesh_data import read_surface
    from mobius_extension.solver import AlignSettings, align, correspond

    source, target = pair
    surfaces = read_surface(source), read_surface(target)
    alignment = align(surfaces[0].mesh, surfaces[1].mesh, AlignSettings(**QUICK))
    found = correspond(alignment)
    stored_alignment.store(target, source, alignment, found, surfaces)
    loaded = stored_alignment.load(target, source, surfaces)
    for name in ("face", "barycentric", "matched", "source_triangles"):
        assert (getattr(loaded, name) == getattr(found, name)).all()
    assert np.allclose(loaded.confidence, found.confidence)
    assert loaded.source_size == found.source_size


# align and transfer in one go


def choose(*objects: Any) -> None:
    for obj in bpy.context.scene.objects:
        obj.select_set(obj in objects)
    activate(objects[-1])


def test_two_selected_meshes_are_aligned_and_the_active_one_gives(pair: tuple[Any, Any]) -> None:
    source, target = pair
    bpy.context.scene.mobius.source = bpy.context.scene.mobius.target = None
    choose(target, source)
    assert bpy.ops.mobius.conformal_transfer(**QUICK | {"refine": "mobius"}) == {"FINISHED"}
    assert np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2).max() < 0.1
    settings = bpy.context.scene.mobius
    assert (settings.source, settings.target) == (source, target)
    assert stored_alignment.exists(target, source)


def test_a_known_alignment_is_not_searched_for_again(pair: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    from mobius_extension.mobius_addon.operators import align

    calls: list[int] = []
    computed = align.aligned
    monkeypatch.setattr(align, "aligned", lambda *a, **k: (calls.append(1), computed(*a, **k))[1])
    choose(*reversed(pair))
    bpy.ops.mobius.conformal_transfer(**QUICK)
    bpy.ops.mobius.conformal_transfer(**QUICK, mix="add")
    assert len(calls) == 1
    pair[1].data.mobius_alignment.target_fingerprint = ""  # as after undo
    bpy.ops.mobius.conformal_transfer(**QUICK, mix="add")
    assert len(calls) == 1  # the same was asked
    pair[1].data.vertices[0].co.z += 0.01
    bpy.ops.mobius.conformal_transfer(**QUICK)
    assert len(calls) == 2


def test_nothing_is_written_where_there_is_nothing_to_carry(pair: tuple[Any, Any]) -> None:
    choose(*reversed(pair))
    before = [everything(obj) for obj in pair]
    with pytest.raises(RuntimeError, match="'Source' has no color attributes to transfer"):
        bpy.ops.mobius.conformal_transfer(**QUICK, kinds={"COLORS"})
    assert [everything(obj) for obj in pair] == before


def test_a_failure_of_the_transfer_takes_the_alignment_back(
    pair: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from mobius_extension.mobius_addon.attributes import plan

    source, target = pair
    choose(*reversed(pair))
    names = [mesh.name for mesh in bpy.data.meshes]
    before = [everything(obj) for obj in pair]
    write = plan._write

    def fails(*given: Any) -> None:
        assert stored_alignment.exists(target, source)  # the alignment is there by now
        write(*given)
        raise MemoryError("no memory")

    monkeypatch.setattr(plan, "_write", fails)
    with pytest.raises(RuntimeError, match="no memory"):
        bpy.ops.mobius.conformal_transfer(**QUICK)
    assert [everything(obj) for obj in pair] == before
    assert not stored_alignment.exists(target, source)
    assert [mesh.name for mesh in bpy.data.meshes] == names
    monkeypatch.undo()
    assert bpy.ops.mobius.conformal_transfer(**QUICK) == {"FINISHED"}


def test_a_failure_of_storing_takes_back_what_align_has_written(
    pair: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: Any) -> None:
        raise MemoryError("no memory")

    before = [everything(obj) for obj in pair]
    monkeypatch.setattr(stored_alignment, "store", fails)
    with pytest.raises(RuntimeError, match="no memory"):
        bpy.ops.mobius.align(**QUICK)
    assert [everything(obj) for obj in pair] == before


def test_the_selection_has_to_be_two_meshes(pair: tuple[Any, Any]) -> None:
    choose(pair[0])
    with pytest.raises(RuntimeError, match="Select two meshes, the source last: it is the active one"):
        bpy.ops.mobius.conformal_transfer()
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    choose(empty, pair[1])
    with pytest.raises(RuntimeError, match="'Empty' is no mesh"):
        bpy.ops.mobius.conformal_transfer()


def test_check_goes_to_edit_mode_on_request() -> None:
    hole = make_sheet("Hole", 6, keep=lambda i, j: (i, j) != (2, 2))
    make_sheet("Active", 4)
    assert bpy.ops.mobius.check(object_name="Hole", edit=True) == {"FINISHED"}
    assert (bpy.context.object, bpy.context.mode) == (hole, "EDIT_MESH")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.mobius.check(object_name="Active", edit=True) == {"FINISHED"}
    assert bpy.context.mode == "OBJECT"  # nothing is wrong with it


# undo


def undone_by_one_step(names: list[str], run: Any) -> None:
    """Run an operator as a person does, take it back, and compare with what was before."""
    bpy.ops.ed.undo_push(message="before")
    before = [str(everything(bpy.data.objects[name])) for name in names]
    assert run("EXEC_DEFAULT", True) == {"FINISHED"}
    assert [str(everything(bpy.data.objects[name])) for name in names] != before
    bpy.ops.ed.undo()
    assert [str(everything(bpy.data.objects[name])) for name in names] == before


def test_one_undo_takes_back_check() -> None:
    obj = make_sheet("Hole", 6, keep=lambda i, j: (i, j) != (2, 2))
    for elements in (obj.data.vertices, obj.data.edges, obj.data.polygons):
        elements.foreach_set("select", [False] * len(elements))
    undone_by_one_step(["Hole"], lambda *how: bpy.ops.mobius.check(*how))


def test_one_undo_takes_back_flatten() -> None:
    make_sheet("Sheet", 6)
    undone_by_one_step(["Sheet"], lambda *how: bpy.ops.mobius.flatten(*how))


def test_one_undo_takes_back_align_on_both_meshes_and_then_transfer_is_refused(pair: tuple[Any, Any]) -> None:
    undone_by_one_step(["Source", "Target"], lambda *how: bpy.ops.mobius.align(*how, **QUICK))
    assert not bpy.ops.mobius.transfer.poll()


def test_one_undo_takes_back_alignment_and_transfer_in_one_go(pair: tuple[Any, Any]) -> None:
    choose(*reversed(pair))
    undone_by_one_step(["Source", "Target"], lambda *how: bpy.ops.mobius.conformal_transfer(*how, **QUICK))


def test_one_undo_takes_back_transfer_and_the_alignment_is_still_there(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    undone_by_one_step(["Source", "Target"], lambda *how: bpy.ops.mobius.transfer(*how))
    assert bpy.ops.mobius.transfer() == {"FINISHED"}


def test_a_refused_operator_leaves_no_undo_step() -> None:
    sheet = make_sheet("Sheet", 6)
    bpy.ops.mobius.flatten("EXEC_DEFAULT", True)
    closed_cube()
    bpy.ops.ed.undo_push(message="cube")
    with pytest.raises(RuntimeError):
        bpy.ops.mobius.flatten("EXEC_DEFAULT", True)
    assert "Mobius Disc" in sheet.data.uv_layers
    bpy.ops.ed.undo()  # takes back the cube, not a step of the refused operator
    assert "Bad" not in bpy.data.objects


# where Blender shows nothing, or another mode reigns


def put_in_collection(obj: Any) -> Any:
    """Move an object into a collection of its own, and return how the view layer shows that one."""
    collection = bpy.data.collections.new("Alone")
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    return bpy.context.view_layer.layer_collection.children["Alone"]


UNSEEN = {
    "excluded": lambda obj: setattr(put_in_collection(obj), "exclude", True),
    "collection hidden": lambda obj: setattr(put_in_collection(obj), "hide_viewport", True),
    "collection disabled": lambda obj: setattr(put_in_collection(obj).collection, "hide_viewport", True),
    "disabled": lambda obj: setattr(obj, "hide_viewport", True),
}
SEEN = {
    "hidden": lambda obj: obj.hide_set(True),
    "unselectable": lambda obj: setattr(obj, "hide_select", True),
    "collection unselectable": lambda obj: setattr(put_in_collection(obj).collection, "hide_select", True),
}


@pytest.mark.parametrize("state", [*UNSEEN, *SEEN])
def test_what_was_found_is_selected_on_objects_that_cannot_be_seen_or_selected(state: str) -> None:
    source, target = make_sheet("Source", 21), make_sheet("Target", 16, keep=lambda i, j: (i, j) != (5, 5))
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = source, target
    make_sheet("Bystander", 4)
    bpy.ops.mobius.align(**QUICK)
    target.data.mobius_alignment.packed = unmatched_at(target, [3, 4])
    (UNSEEN | SEEN)[state](target)
    bpy.context.view_layer.update()
    hidden = target.hide_get()
    for run, expected in (
        (lambda: bpy.ops.mobius.select_unmatched(edit=True), {3, 4}),
        (lambda: bpy.ops.mobius.check(object_name="Target", edit=True), {85, 86, 101, 102}),
    ):
        assert run() == {"FINISHED"}
        assert bpy.context.mode == ("EDIT_MESH" if state in SEEN else "OBJECT")
        if state in SEEN:
            assert bpy.context.object == target
            assert bpy.data.objects["Bystander"].mode == "OBJECT"
            bpy.ops.object.mode_set(mode="OBJECT")
        else:
            assert target.hide_get() == hidden
        assert {vertex.index for vertex in target.data.vertices if vertex.select} == expected


def unmatched_at(target: Any, vertices: list[int]) -> bytes:
    """The target's stored alignment with everything matched but these vertices."""
    import io

    with np.load(io.BytesIO(target.data.mobius_alignment.packed)) as stored:
        arrays = dict(stored)
    arrays["matched"] = ~np.isin(np.arange(len(arrays["matched"])), vertices)
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    return packed.getvalue()


@pytest.mark.parametrize("state", [*UNSEEN, *SEEN])
@pytest.mark.parametrize("which", [0, 1])
def test_every_operator_works_on_objects_that_cannot_be_seen_or_selected(
    pair: tuple[Any, Any], state: str, which: int
) -> None:
    _, target = pair
    (UNSEEN | SEEN)[state](pair[which])
    bpy.context.view_layer.update()
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert np.ptp(weights(target, "Right")) > 0.9
    assert bpy.ops.mobius.heat_map() == {"FINISHED"}
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert bpy.ops.mobius.end_side_by_side() == {"FINISHED"}
    assert [obj.name for obj in bpy.data.objects] == ["Source", "Target"]


def test_hidden_vertices_are_not_selected_but_told() -> None:
    hole = make_sheet("Hole", 6, keep=lambda i, j: (i, j) != (2, 2))
    for index in (14, 15):
        hole.data.vertices[index].hide = True
    assert bpy.ops.mobius.check() == {"FINISHED"}
    assert [vertex.index for vertex in hole.data.vertices if vertex.select] == [20, 21]


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT"])
def test_nothing_is_written_while_another_object_is_edited(pair: tuple[Any, Any], mode: str) -> None:
    # Blender keeps the undo steps of such a mode apart, and some writing is not possible in it
    bpy.ops.mobius.align(**QUICK)
    before = [everything(obj) for obj in pair]
    make_sheet("Bystander", 4)
    bpy.ops.object.mode_set(mode=mode)
    for name, given in (
        ("align", QUICK), ("transfer", {}), ("heat_map", {}), ("side_by_side", {}), ("select_unmatched", {}),
    ):  # fmt: skip
        with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
            getattr(bpy.ops.mobius, name)(**given)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [everything(obj) for obj in pair] == before


def test_a_mesh_that_is_edited_through_another_object_is_refused_and_stays(pair: tuple[Any, Any]) -> None:
    _, target = pair
    twin = bpy.data.objects.new("Twin", target.data)
    bpy.context.scene.collection.objects.link(twin)
    for obj in bpy.context.scene.objects:
        obj.select_set(False)
    activate(twin)
    bpy.ops.object.mode_set(mode="EDIT")
    assert target.mode == "OBJECT"
    with pytest.raises(RuntimeError, match="'Target' shares its mesh with an object in Edit Mode"):
        bpy.ops.mobius.align(**QUICK)
    with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
        bpy.ops.mobius.check(object_name="Target")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}


def test_an_object_has_its_number_through_undo_redo_and_a_new_name(pair: tuple[Any, Any]) -> None:
    # what a job that goes on meanwhile finds its objects by
    before = [obj.session_uid for obj in pair]
    bpy.ops.ed.undo_push(message="begin")
    pair[0].name = "Renamed"
    bpy.ops.ed.undo_push(message="renamed")
    bpy.ops.ed.undo()
    assert [bpy.data.objects[name].session_uid for name in ("Source", "Target")] == before
    bpy.ops.ed.redo()
    assert [bpy.data.objects[name].session_uid for name in ("Renamed", "Target")] == before


def test_a_failure_in_edit_mode_never_removes_the_object(pair: tuple[Any, Any]) -> None:
    from mobius_extension.mobius_addon.attributes import restored_on_failure

    source, _ = pair
    activate(source)
    bpy.ops.object.mode_set(mode="EDIT")
    meshes = len(bpy.data.meshes)
    with pytest.raises(MemoryError), restored_on_failure(source):
        raise MemoryError("no memory")
    assert (source.name, source.mode) == ("Source", "EDIT")
    assert len(bpy.data.meshes) == meshes
