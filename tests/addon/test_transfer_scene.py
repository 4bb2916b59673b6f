"""Transfers in a scene: many targets, modifiers, shared and linked meshes, undo, failure and cancellation."""

from typing import Any

import numpy as np
import pytest
from scenes import QUICK, everything, make_sheet, positions, weights
from test_operators import undone_by_one_step
from test_transfer_rules import add_group

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import AttributeAccess, VertexGroupAccess  # noqa: E402
from mobius_extension.mobius_addon.evaluated import evaluated  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, foreach, read_surface  # noqa: E402
from mobius_extension.mobius_addon.operators.transfer import MOBIUS_OT_transfer  # noqa: E402
from mobius_extension.solver import Progress  # noqa: E402


def align_all(source: Any, targets: list[Any], chosen: Any) -> None:
    scene = bpy.context.scene
    scene.mobius.source = source
    for target in [x for x in targets if x != chosen] + [chosen]:
        scene.mobius.target = target
        assert bpy.ops.mobius.align(**QUICK | {"refine": "dense"}) == {"FINISHED"}


@pytest.fixture
def aligned(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    align_all(pair[0], [pair[1]], pair[1])
    return pair


def contents() -> tuple[list[str], ...]:
    """Names of everything that could be left behind."""
    data = (bpy.data.objects, bpy.data.meshes, bpy.data.node_groups, bpy.data.shape_keys, bpy.data.materials)
    return tuple(sorted(x.name for x in kind) for kind in data)


# many targets


def test_all_selected_meshes_receive_in_one_step(pair: tuple[Any, Any]) -> None:
    source, target = pair
    others = [make_sheet("Second", 12), make_sheet("Third", 14)]
    targets = [target, *others]
    align_all(source, targets, target)
    for obj in targets:
        obj.select_set(True)
    names = [obj.name for obj in targets]
    undone_by_one_step(names, lambda *how: bpy.ops.mobius.transfer(*how, carry_to="selected"))
    assert bpy.ops.mobius.transfer(carry_to="selected") == {"FINISHED"}
    for name in names:
        obj = bpy.data.objects[name]
        assert np.abs(weights(obj, "Right") - (positions(obj)[:, 0] + 1) / 2).max() < 0.05


def test_selected_meshes_that_cannot_receive_are_named(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    other = make_sheet("Second", 12)
    before = everything(target)
    target.select_set(True)
    with pytest.raises(RuntimeError, match="'Second' has not been aligned with 'Source' yet"):
        bpy.ops.mobius.transfer(carry_to="selected")
    assert everything(target) == before
    other.data = target.data
    with pytest.raises(RuntimeError, match="share one mesh"):
        bpy.ops.mobius.transfer(carry_to="selected")
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    source.select_set(True)
    with pytest.raises(RuntimeError, match="Select the meshes that shall receive what is on 'Source'"):
        bpy.ops.mobius.transfer(carry_to="selected")


# which mesh


def test_an_evaluated_source_has_what_its_modifiers_made(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    edit = source.modifiers.new("Weights", "VERTEX_WEIGHT_EDIT")
    edit.vertex_group, edit.invert_falloff = "Right", True
    before = contents()
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    original = weights(target, "Right")
    assert np.abs(original - (positions(target)[:, 0] + 1) / 2).max() < 0.05
    assert bpy.ops.mobius.transfer(evaluated=True) == {"FINISHED"}
    assert weights(target, "Right") == pytest.approx(1 - original, abs=1e-4)
    assert contents() == before


def subdivide(source: Any) -> None:
    source.modifiers.new("Smooth", "SUBSURF").levels = 2


def thin_out(source: Any) -> None:
    source.modifiers.new("Fewer", "DECIMATE").ratio = 0.6


def thicken(source: Any) -> None:
    source.modifiers.new("Thick", "SOLIDIFY").thickness = 0.3


def roll(source: Any) -> None:
    """More faces, and in another place."""
    source.modifiers.new("Smooth", "SUBSURF").levels = 1
    bend = source.modifiers.new("Roll", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis, bend.angle = "BEND", "X", 2.0


def join_a_cube(source: Any) -> None:
    """Geometry nodes that subdivide what they are given, and put a cube of their own beside it."""
    nodes = bpy.data.node_groups.new("Cube", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeSubdivideMesh", "GeometryNodeMeshCube")
    given, finer, cube = (nodes.nodes.new(kind) for kind in kinds)
    joined, made = nodes.nodes.new("GeometryNodeJoinGeometry"), nodes.nodes.new("NodeGroupOutput")
    nodes.links.new(given.outputs[0], finer.inputs[0])
    for part in (finer, cube):
        nodes.links.new(part.outputs[0], joined.inputs[0])
    nodes.links.new(joined.outputs[0], made.inputs[0])
    source.modifiers.new("Cube", "NODES").node_group = nodes


@pytest.mark.parametrize("change", [subdivide, thin_out, thicken, roll, join_a_cube])
def test_modifiers_may_change_the_faces(aligned: tuple[Any, Any], change: Any) -> None:
    """What is carried is what the original would give, by way of the faces that the modifiers made of it."""
    source, target = aligned
    uv = source.data.uv_layers.new(name="Plan")
    corners = np.array([source.data.vertices[loop.vertex_index].co[:2] for loop in source.data.loops])
    uv.uv.foreach_set("vector", corners.astype(np.float32).ravel())
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    original = weights(target, "Right"), corner_uvs(target, "Plan")
    clear_transferred(target)
    change(source)
    before = contents()
    assert bpy.ops.mobius.transfer(evaluated=True, kinds={"VERTEX_GROUPS", "UV", "ATTRIBUTES"}) == {"FINISHED"}
    if change is join_a_cube and bpy.app.version < (4, 5):  # where joining makes attributes of vertex groups
        add_group(target, "Right", foreach(target.data.attributes["Right"].data, "value", 1, np.float32))
    apart = np.abs(weights(target, "Right") - original[0])
    assert apart.mean() < 0.01
    assert apart.max() < 0.1
    assert np.abs(corner_uvs(target, "Plan") - original[1]).mean() < 0.02
    assert contents() == before
    assert "mobius_trace" not in {x.name for x in (*source.data.attributes, *target.data.attributes)}


def corner_uvs(obj: Any, name: str) -> np.ndarray:
    return np.array([x.vector[:] for x in obj.data.uv_layers[name].uv])


def clear_transferred(target: Any) -> None:
    target.vertex_groups.remove(target.vertex_groups["Right"])
    target.data.uv_layers.remove(target.data.uv_layers["Plan"])


def test_one_undo_takes_back_a_transfer_from_other_faces(aligned: tuple[Any, Any]) -> None:
    subdivide(aligned[0])
    undone_by_one_step(["Source", "Target"], lambda *how: bpy.ops.mobius.transfer(*how, evaluated=True))


def test_what_a_modifier_takes_away_is_no_counterpart(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    add_group(source, "Kept", (positions(source)[:, 0] > 0).astype(float))
    mask = source.modifiers.new("Half", "MASK")
    mask.vertex_group = "Kept"
    assert bpy.ops.mobius.transfer(evaluated=True, unmatched="leave", kinds={"VERTEX_GROUPS"}) == {"FINISHED"}
    carried, x = weights(target, "Right"), positions(target)[:, 0]
    assert np.abs(carried - (x + 1) / 2)[x > 0.3].max() < 0.05
    assert not carried[x < -0.3].any()


def test_the_mirrored_half_is_not_taken_for_the_original(aligned: tuple[Any, Any]) -> None:
    """Its vertices come from the same places, its groups are those of the other side."""
    source, target = aligned
    source.vertex_groups["Right"].name = "Hand.R"
    add_group(source, "Hand.L", np.zeros(len(source.data.vertices)))
    mirror = source.modifiers.new("Mirror", "MIRROR")
    mirror.use_mirror_vertex_groups, mirror.use_mirror_merge = True, False
    assert bpy.ops.mobius.transfer(evaluated=True, kinds={"VERTEX_GROUPS"}) == {"FINISHED"}
    assert np.abs(weights(target, "Hand.R") - (positions(target)[:, 0] + 1) / 2).max() < 0.05


def test_shape_keys_are_the_originals_whatever_the_modifiers_make(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    source.shape_key_add(name="Basis")
    key = source.shape_key_add(name="Up")
    key.points.foreach_set("co", (positions(source) + np.array([0, 0, 0.25])).astype(np.float32).ravel())
    subdivide(source)
    before = contents()
    assert bpy.ops.mobius.transfer(evaluated=True, kinds={"SHAPE_KEYS", "VERTEX_GROUPS"}) == {"FINISHED"}
    moved = np.array([x.co[:] for x in target.data.shape_keys.key_blocks["Up"].points]) - positions(target)
    assert np.linalg.norm(moved, axis=1) == pytest.approx(0.25, rel=0.2)
    assert contents()[:3] == before[:3]


def test_faces_that_do_not_tell_where_they_come_from_are_refused(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    before = everything(target), contents()
    source.modifiers.new("Blocks", "REMESH").mode = "BLOCKS"
    with pytest.raises(RuntimeError, match=r"Modifiers of 'Source' \('Blocks'\) make faces that do not tell where"):
        bpy.ops.mobius.transfer(evaluated=True)
    assert (everything(target), contents()) == before


def test_an_object_that_blender_does_not_evaluate_is_refused() -> None:
    loose = bpy.data.objects.new("Loose", make_sheet("Sheet", 4).data)
    own = read_surface(loose)
    with pytest.raises(Refusal, match="'Loose' is hidden, so Blender does not evaluate it"), evaluated(loose, own):
        pass


def test_shape_keys_of_an_evaluated_source_are_its_own(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    source.shape_key_add(name="Basis")
    key = source.shape_key_add(name="Up")
    key.points.foreach_set("co", (positions(source) + np.array([0, 0, 0.25])).astype(np.float32).ravel())
    key.value = 1.0
    assert bpy.ops.mobius.transfer(evaluated=True, kinds={"SHAPE_KEYS"}) == {"FINISHED"}
    moved = np.array([x.co[:] for x in target.data.shape_keys.key_blocks["Up"].points]) - positions(target)
    assert np.linalg.norm(moved, axis=1) == pytest.approx(0.25, rel=0.2)


def test_transforms_of_the_objects_do_not_matter(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    before = everything(target)
    source.location, source.rotation_euler, source.scale = (5, 6, 7), (1, 2, 3), (2, 2, 2)
    target.location, target.scale = (-5, 0, 3), (0.1, 0.1, 0.1)
    bpy.context.view_layer.update()
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert everything(target) == before


def test_a_mesh_that_others_use_changes_for_all_and_that_is_said(aligned: tuple[Any, Any]) -> None:
    _, target = aligned
    twin = bpy.data.objects.new("Twin", target.data)
    bpy.context.scene.collection.objects.link(twin)
    operator: Any = Operator()
    plan = MOBIUS_OT_transfer.prepare(operator, bpy.context)(lambda progress: None)[0]
    assert plan.warnings == ("'Target' shares its mesh with other objects: they change with it",)
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert "Right" in twin.vertex_groups


def test_edit_mode_is_refused_with_the_reason(aligned: tuple[Any, Any]) -> None:
    _, target = aligned
    bpy.context.view_layer.objects.active = target
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="'Target' is in Edit Mode: switch to Object Mode first"):
        bpy.ops.mobius.transfer()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_linked_target_is_refused_and_a_linked_source_gives(aligned: tuple[Any, Any], tmp_path: Any) -> None:
    subdivide(aligned[0])
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Source", "Target"]
    source, target = wanted.objects
    for obj in (source, target):
        bpy.context.scene.collection.objects.link(obj)
    mobius = bpy.context.scene.mobius
    mobius.source, mobius.target = source, target
    with pytest.raises(RuntimeError, match="'Target' is linked from another file: make it local first"):
        bpy.ops.mobius.transfer()
    local = target.copy()
    bpy.context.scene.collection.objects.link(local)
    local.data = target.data.copy()
    mobius.target = local
    before = contents()
    for evaluated_source in (False, True):
        assert bpy.ops.mobius.transfer(evaluated=evaluated_source) == {"FINISHED"}
        assert np.abs(weights(local, "Right") - (positions(local)[:, 0] + 1) / 2).max() < 0.05
        local.vertex_groups.clear()
    assert contents() == before


# select unmatched


def test_select_unmatched_selects_what_the_mask_of_the_source_leaves_and_undoes(aligned: tuple[Any, Any]) -> None:
    source, target = aligned
    add_group(source, "Half", (positions(source)[:, 0] > 0).astype(float))
    names = ["Target"]
    choice = {"source_mask": "named", "source_mask_name": "Half"}
    target.data.vertices.foreach_set("select", np.zeros(len(target.data.vertices), bool))
    undone_by_one_step(names, lambda *how: bpy.ops.mobius.select_unmatched(*how, **choice))
    target = bpy.data.objects["Target"]
    assert bpy.ops.mobius.select_unmatched(**choice) == {"FINISHED"}
    selected = np.array([v.select for v in target.data.vertices])
    x = positions(target)[:, 0]
    assert selected[x < -0.15].all()
    left = selected.copy()
    assert bpy.ops.mobius.select_unmatched(**choice | {"source_mask_invert": True}, extend=True) == {"FINISHED"}
    assert np.array([v.select for v in target.data.vertices])[left | (x > 0.15)].all()


def test_select_unmatched_needs_an_alignment(pair: tuple[Any, Any]) -> None:
    with pytest.raises(RuntimeError, match="'Target' has not been aligned with 'Source' yet"):
        bpy.ops.mobius.select_unmatched()


# failure and cancellation


@pytest.mark.parametrize("broken", [AttributeAccess, VertexGroupAccess])
def test_a_failure_while_writing_leaves_every_target_as_it_was(
    pair: tuple[Any, Any], broken: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = pair
    other = make_sheet("Second", 12)
    align_all(source, [target, other], target)
    for obj in (target, other):
        obj.shape_key_add(name="Basis")
        add_group(obj, "Right", 0.5)
        obj.data.materials.append(bpy.data.materials.new("Cloth"))
        obj.select_set(True)
    source.shape_key_add(name="Basis")
    source.shape_key_add(name="Smile")
    before = everything(target), everything(other), contents()
    write = broken.write

    def fails(self: Any, obj: Any, *rest: Any) -> None:
        write(self, obj, *rest)
        if obj == target:  # which is written last
            raise MemoryError("no memory")

    monkeypatch.setattr(broken, "write", fails)
    with pytest.raises(RuntimeError, match="no memory"):
        bpy.ops.mobius.transfer(carry_to="selected")
    assert (everything(target), everything(other), contents()) == before
    assert target.data.shape_keys.key_blocks.keys() == ["Basis"]
    monkeypatch.undo()
    assert bpy.ops.mobius.transfer(carry_to="selected") == {"FINISHED"}


class Operator:
    """Stands in for the running operator: Blender makes instances itself only."""

    def __init__(self, **choices: Any) -> None:
        from mobius_extension.mobius_addon.options import TRANSFER_OPTIONS

        for name in TRANSFER_OPTIONS:
            setattr(self, name, choices.get(name, getattr(bpy.context.scene.mobius, name)))


@pytest.mark.parametrize("from_modifiers", [False, True])
def test_a_cancelled_transfer_changes_nothing(aligned: tuple[Any, Any], from_modifiers: bool) -> None:
    from mobius_extension.solver import Cancelled

    source, target = aligned
    subdivide(source)
    before = everything(target), contents()
    operator: Any = Operator(evaluated=from_modifiers)
    work = MOBIUS_OT_transfer.prepare(operator, bpy.context)
    steps: list[Progress] = []

    def stop(progress: Progress) -> bool:
        steps.append(progress)
        return len(steps) < 2

    with pytest.raises(Cancelled):
        work(stop)
    assert [step.stage for step in steps] == ["Vertex Groups of 'Target'", "Smooth Flags of 'Target'"]
    assert (everything(target), contents()) == before


def test_the_work_may_run_while_objects_are_gone(aligned: tuple[Any, Any]) -> None:
    """What a worker thread computes on are arrays; what it found is refused if its target is gone."""
    source, target = aligned
    operator: Any = Operator()
    work = MOBIUS_OT_transfer.prepare(operator, bpy.context)
    bpy.data.objects.remove(source)
    bpy.data.objects.remove(target)
    result = work(lambda progress: None)
    with pytest.raises(Refusal, match="'Target' was removed or is being edited since the transfer began"):
        MOBIUS_OT_transfer.finish(operator, bpy.context, result)
