"""The rig comes along: its joints lie where they belong in the target, and a bone moves it as it moves the source."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import bumps, make_object, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mathutils import Matrix  # noqa: E402
from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.attributes.rig import armature_of  # noqa: E402
from mobius_extension.mobius_addon.command_line.program import main  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, read_surface  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402
from mobius_extension.solver.flatten.locate import TriangulatedDisc  # noqa: E402

BONES = {
    # head, tail, roll, parent, connected
    "Root": ((0, 0, -1), (0, 0, -0.4), 0.3, None, False),
    "Neck": ((0, 0, -0.4), (0.1, -0.2, 0.05), -0.7, "Root", True),
    "Eye.L": ((0.4, 0.3, 0.1), (0.45, 0.3, 0.5), 1.1, "Neck", False),
    "Eye.R": ((-0.4, 0.3, 0.1), (-0.45, 0.3, 0.5), 0.4, "Neck", False),
}


@pytest.fixture
def source() -> Any:
    """A sheet with a rig of four bones, an action and a constraint, away from the origin."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj = make_sheet("Source", 22)
    place = positions(obj)
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (head, tail, roll, parent, connected) in BONES.items():
        bone = rig.data.edit_bones.new(name)
        bone.head, bone.tail, bone.roll = head, tail, roll
        if parent:
            bone.parent = rig.data.edit_bones[parent]
            bone.use_connect = connected
    bpy.ops.object.mode_set(mode="OBJECT")
    limit = rig.pose.bones["Eye.R"].constraints.new("COPY_ROTATION")
    limit.target, limit.subtarget, limit.influence = rig, "Eye.L", 0.5
    limit.target_space = limit.owner_space = "LOCAL"
    weight = np.exp(-((place[:, None, :2] - [[0.4, 0.3], [-0.4, 0.3]]) ** 2).sum(axis=2) / 0.1)
    for name, column in (("Eye.L", weight[:, 0]), ("Eye.R", weight[:, 1]), ("Neck", 1 - weight.sum(axis=1).clip(0, 1))):
        group = obj.vertex_groups.new(name=name)
        for vertex, value in enumerate(column):
            group.add([vertex], float(value), "REPLACE")
    obj.modifiers.new("Bends", "ARMATURE").object = rig
    obj.parent = rig
    rig.location, rig.rotation_euler = (1, 2, 3), (0.2, 0.5, -0.4)
    bpy.context.view_layer.update()
    return obj


def likeness(source: Any, n: int, matrix: Any, mirror: bool = False) -> tuple[Any, Carrier]:
    """A sheet of another mesh, moved in its own space by a matrix, and the exact map: the source is a height field."""
    target = make_sheet("Target", n)
    if mirror:
        for vertex in target.data.vertices:
            vertex.co.x *= -1
        target.data.flip_normals()
    places = positions(target) * ([-1, 1, 1] if mirror else [1, 1, 1])
    surfaces = read_surface(source), read_surface(target)
    flat = [x[:, 0] + 1j * x[:, 1] for x in (surfaces[0].mesh.vertices, places)]
    found = TriangulatedDisc.of(flat[0], surfaces[0].mesh.faces).locate(flat[1])
    everywhere = np.ones(len(places), bool)
    correspondence = Correspondence(
        found[0], found[1], everywhere, everywhere.astype(float), surfaces[0].mesh.faces, len(source.data.vertices)
    )
    target.data.transform(matrix)
    target.location, target.rotation_euler = (-4, 1, 0), (0.1, -0.3, 2)
    bpy.context.view_layer.update()
    return target, Carrier(correspondence, surfaces[0], read_surface(target))


def carried(source: Any, target: Any, carrier: Carrier) -> Any:
    plan_transfer(source, target, carrier, TransferSettings(kinds=("vertex-groups",), rig=True)).write(target)
    bpy.context.view_layer.update()
    return armature_of(target)


def shown(obj: Any) -> np.ndarray:
    """Where modifiers show the vertices, in the object's own space."""
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([vertex.co[:] for vertex in evaluated.data.vertices])


SIMILAR = Matrix.Translation((0.3, -1, 2)) @ Matrix.Rotation(1.2, 4, (1.0, 2.0, -0.5)) @ Matrix.Scale(2.5, 4)


def test_onto_an_identical_mesh_comes_an_identical_rig(source):
    rig = source.parent
    target, carrier = likeness(source, 22, Matrix())
    new = carried(source, target, carrier)
    assert new != rig
    assert new.data != rig.data
    assert target.parent == new
    assert target.modifiers["Bends"].object == new
    assert np.abs(np.array(target.matrix_world.inverted() @ new.matrix_world)
                  - np.array(source.matrix_world.inverted() @ rig.matrix_world)).max() < 1e-5  # fmt: skip
    for bone in rig.data.bones:
        other = new.data.bones[bone.name]
        assert np.abs(np.array(bone.matrix_local) - np.array(other.matrix_local)).max() < 1e-5
        assert other.length == pytest.approx(bone.length, abs=1e-5)
        assert other.use_connect == bone.use_connect
        assert (other.parent and other.parent.name) == (bone.parent and bone.parent.name)
    (constraint,) = new.pose.bones["Eye.R"].constraints
    assert constraint.target == new
    assert bpy.context.mode == "OBJECT"
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]


@pytest.mark.parametrize("n", [22, 31])
def test_a_bone_of_a_similar_target_moves_it_as_the_source(source, n):
    rig = source.parent
    target, carrier = likeness(source, n, SIMILAR)
    place = np.array(target.matrix_world)
    new = carried(source, target, carrier)
    assert np.abs(np.array(target.matrix_world) - place).max() < 1e-5
    rest = positions(target)
    assert np.abs(shown(target) - rest).max() < 1e-4
    for armature in (rig, new):
        for name, turn in (("Neck", (0.9, 0.1, -0.2, 0.3)), ("Eye.L", (0.8, 0.5, 0, 0))):
            armature.pose.bones[name].rotation_quaternion = turn
        armature.pose.bones["Neck"].location = (0.1, 0.05, -0.02)
    bpy.context.view_layer.update()
    moved = carrier.correspondence.matrix() @ (shown(source) - positions(source))
    wanted = moved @ np.array(SIMILAR.to_3x3()).T
    apart = np.linalg.norm(shown(target) - rest - wanted, axis=1).max() / np.linalg.norm(wanted, axis=1).max()
    # weights and places between vertices are interpolated
    assert apart < (1e-4 if n == 22 else 0.01)


def test_of_a_mirrored_target_left_and_right_change_places(source):
    target, carrier = likeness(source, 22, Matrix(), mirror=True)
    assert carrier.mirrors
    new = carried(source, target, carrier)
    for name, other in (("Eye.L", "Eye.R"), ("Eye.R", "Eye.L"), ("Neck", "Neck")):
        expected = np.array(source.parent.data.bones[name].head_local)
        at = target.matrix_world.inverted() @ new.matrix_world @ new.data.bones[other].head_local
        was = source.matrix_world.inverted() @ source.parent.matrix_world @ source.parent.data.bones[name].head_local
        assert np.array(at) == pytest.approx(np.array(was) * [-1, 1, 1], abs=1e-4), expected
    assert new.pose.bones["Eye.L"].constraints[0].subtarget == "Eye.R"
    assert source.parent.pose.bones["Eye.R"].constraints[0].subtarget == "Eye.L"
    # a bone moves what its group holds
    new.pose.bones["Eye.L"].location = (0, 0.3, 0)
    bpy.context.view_layer.update()
    moved = np.linalg.norm(shown(target) - positions(target), axis=1)
    assert np.abs(positions(target)[moved.argmax(), :2] - [0.4, 0.3]).max() < 0.1


def test_a_rig_of_the_targets_own_stays_and_nothing_comes_of_none(source):
    target, carrier = likeness(source, 22, Matrix())
    own = bpy.data.objects.new("Own", bpy.data.armatures.new("Own"))
    target.modifiers.new("Own", "ARMATURE").object = own
    plan = plan_transfer(source, target, carrier, TransferSettings(rig=True))
    assert any("'Target' is moved by 'Own', which stays" in said for said in plan.warnings)
    plan.write(target)
    assert armature_of(target) == own
    assert len(target.modifiers) == 1
    source.modifiers.clear()
    source.parent = None
    with pytest.raises(Refusal, match="'Source' has no armature"):
        plan_transfer(source, target, carrier, TransferSettings(rig=True))


def test_without_asking_no_rig_comes(source):
    target, carrier = likeness(source, 22, Matrix())
    plan_transfer(source, target, carrier).write(target)
    assert armature_of(target) is None
    assert len(bpy.data.armatures) == 1


def test_a_failure_leaves_no_rig_behind(source, monkeypatch):
    from mobius_extension.mobius_addon.attributes import fitted_rig

    target, carrier = likeness(source, 22, Matrix())
    plan = plan_transfer(source, target, carrier, TransferSettings(rig=True))

    def fail(*_: Any) -> None:
        raise RuntimeError("no")

    monkeypatch.setattr(fitted_rig, "_look_at_itself", fail)
    with pytest.raises(RuntimeError, match="no"):
        plan.write(target)
    assert [x.name for x in bpy.data.armatures] == ["Rig"]
    assert len(bpy.data.objects) == 3
    assert armature_of(target) is None
    assert not target.vertex_groups
    assert not target.modifiers


@pytest.mark.parametrize("ending", [".blend", ".glb", ".fbx"])
def test_the_command_line_writes_the_skeleton(source, ending, tmp_path: Path, capsys):
    target, _ = likeness(source, 19, SIMILAR)
    rest = np.array([source.parent.data.bones[name].head_local for name in BONES])
    relative = np.array(source.matrix_world.inverted() @ source.parent.matrix_world)
    wanted = (np.c_[rest, np.ones(4)] @ relative.T @ np.array(target.matrix_world @ SIMILAR).T)[:, :3]
    bpy.data.libraries.write(str(tmp_path / "source.blend"), {source})
    for gone in (source, source.parent):
        bpy.data.objects.remove(gone)
    bpy.data.orphans_purge()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "target.blend"))
    out = tmp_path / f"out{ending}"
    options = ["--samples", "50", "--targets", "200", "--reflect", "never"]
    given = ["transfer", str(tmp_path / "source.blend"), str(tmp_path / "target.blend"), "-o", str(out)]
    assert main([*given, "--only", "vertex-groups", "--rig", *options]) == 0
    assert "bone" not in capsys.readouterr().err
    with files.opened(str(out), write=False) as found:
        obj = found.target.obj
        armature = armature_of(obj)
        assert armature is not None
        assert set(BONES) <= {bone.name for bone in armature.data.bones}
        assert {group.name for group in obj.vertex_groups} >= {"Eye.L", "Eye.R", "Neck"}
        bpy.context.view_layer.update()
        heads = np.array([(armature.matrix_world @ armature.data.bones[name].head_local)[:] for name in BONES])
    assert len(bpy.data.armatures) == 1
    assert np.abs(heads - wanted).max() < 0.02 * 2.5 * np.sqrt(8)


def test_a_mesh_that_no_bone_moves_is_alone_in_its_file(tmp_path: Path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj = make_object("Plain", [(0, 0, 0), (1, 0, 0), (0, 1, bumps(np.zeros(1), np.zeros(1))[0])], [(0, 1, 2)])
    with files.outputs() as written:
        files.write_mesh(obj, tmp_path / "plain.glb", written)
    assert not bpy.data.armatures
