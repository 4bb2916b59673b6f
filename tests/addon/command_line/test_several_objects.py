"""Files of several mesh objects, given without a name: one thing for the computation, and several when written."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import QUICK
from scenes import make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line.program import main  # noqa: E402

EYE = (0.3, 0.3, 0.25)


def face(name: str, n: int, cells: int) -> dict[str, Any]:
    """A sheet and a ball on it, which is an object of another origin, turn and size, mirrored too."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=2 * cells, ring_count=cells, radius=0.1, location=EYE)
    eye = bpy.context.active_object
    eye.name = f"{name} Eye"
    bpy.context.view_layer.update()
    place = eye.matrix_world.copy()
    eye.scale, eye.rotation_euler = (-2, 2, 2), (0.3, 1, 2)
    bpy.context.view_layer.update()
    eye.data.transform(eye.matrix_world.inverted() @ place)
    eye.data.flip_normals()
    eye.data.uv_layers[0].name = "Iris"
    return {"skin": make_sheet(name, n), "eye": eye}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A source.blend of a skin and an eye with data of their own, and a target.blend and .glb of the same kind."""
    both = face("Source", 22, 8)
    both["skin"].vertex_groups.new(name="Jaw").add(range(100), 1.0, "REPLACE")
    both["eye"].vertex_groups.new(name="Look").add(range(200), 0.5, "REPLACE")
    for obj in both.values():
        obj.data.materials.append(bpy.data.materials.new(obj.name))
        obj.shape_key_add(name="Basis")
    up = np.array(both["eye"].matrix_world.to_3x3().inverted()) @ [0, 0, 0.1]
    bent = np.outer(np.sin(3 * positions(both["skin"])[:, 0]), [0, 0, 0.1])
    for obj, step, names in ((both["skin"], bent, ("Up",)), (both["eye"], up, ("Up", "Blink"))):
        for key in names:
            places = positions(obj) + step
            obj.shape_key_add(name=key).points.foreach_set("co", places.astype(np.float32).ravel())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "source.blend"))
    bare = face("Target", 19, 7)["eye"].data
    bare.uv_layers.remove(bare.uv_layers[0])
    lamp = make_sheet("Lamp", 5)
    lamp.location.x = 30
    bpy.ops.mesh.primitive_plane_add(size=50, location=(0, 0, -0.1))
    bpy.context.active_object.name = "Floor"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "target.blend"))
    bpy.data.batch_remove([lamp, bpy.data.objects["Floor"]])
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "target.glb"))
    return tmp_path


@pytest.mark.parametrize("ending", [".blend", ".glb"])
def test_every_object_gets_what_its_counterpart_has(
    folder: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out, given = folder / f"out{ending}", [str(folder / "source.blend"), str(folder / f"target{ending}")]
    only = ["--only", "vertex-groups,shape-keys,uv,materials"]
    assert main(["transfer", *given, "-o", str(out), *QUICK, "--refine", "dense", *only]) == 0
    said = capsys.readouterr().err
    assert "2 mesh objects" in said
    assert "count as one ('Target', 'Target Eye')" in said
    assert ("'Floor', 'Lamp' are left out" in said) == (ending == ".blend")
    if ending == ".glb":
        files.new_scene()
        files.import_meshes(out)
    else:
        bpy.ops.wm.open_mainfile(filepath=str(out))
    skin, eye = bpy.data.objects["Target"], bpy.data.objects["Target Eye"]
    assert sorted(bpy.data.objects.keys()) == sorted(
        ["Target", "Target Eye", *(["Lamp", "Floor"] if ending == ".blend" else [])]
    )
    name = "Iris" if ending == ".blend" else "UVMap"  # which .glb does not know, nor groups without bones
    if ending == ".blend":
        assert [x.name for x in skin.vertex_groups] == ["Jaw"]
        assert [x.name for x in eye.vertex_groups] == ["Look"]
        assert np.ptp(weights(skin, "Jaw")) > 0.9
        assert np.allclose(weights(eye, "Look"), 0.5, atol=1e-3)
    assert [x.name for x in eye.data.uv_layers] == [name]
    assert not skin.data.uv_layers
    assert [x.name for x in skin.data.materials] == ["Source"]
    assert [x.name for x in eye.data.materials] == ["Source Eye"]
    for obj, names in ((skin, ["Up"]), (eye, ["Up", "Blink"])):
        keys = obj.data.shape_keys.key_blocks
        assert [key.name for key in keys][1:] == names
        bpy.context.view_layer.update()
        rest = np.array([x.co[:] for x in keys[0].points])
        for name in names:
            moved = np.array([x.co[:] for x in keys[name].points]) - rest
            world = moved @ np.array(obj.matrix_world.to_3x3()).T
            height = 0.1 * np.sin(3 * rest[:, 0]) if obj == skin else np.full(len(rest), 0.1)
            assert np.allclose(world, height[:, None] * [0, 0, 1], atol=0.02)
            # a .glb of flat faces has a vertex for each corner
            _, first, place = np.unique(rest.round(5), axis=0, return_index=True, return_inverse=True)
            assert (len(first) < len(rest)) == (ending == ".glb")
            assert np.allclose(moved, moved[first][place.ravel()], atol=1e-5)


def test_two_of_the_same_are_no_one_thing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("Lower", 8)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "steps.blend"))
    make_sheet("Higher", 12)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "steps.blend"))
    given = ["transfer", str(folder / "source.blend"), str(folder / "steps.blend"), "-o", str(folder / "out.blend")]
    assert main(given) == 2
    assert "fill the same place: name one as" in capsys.readouterr().err


def test_a_file_for_one_mesh_is_refused_before_any_work(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["transfer", str(folder / "source.blend"), str(folder / "target.glb"), "-o", str(folder / "out.ply")]
    assert main(given) == 1
    assert "can hold one mesh and not 2: write one of .blend .obj .glb" in capsys.readouterr().err
    assert not (folder / "out.ply").exists()


def test_one_rig_moves_all(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(folder / "source.blend"))
    bpy.ops.object.armature_add()
    armature = bpy.context.active_object
    armature.data.bones[0].name = "Jaw"
    for name in ("Source", "Source Eye"):
        bpy.data.objects[name].modifiers.new("Armature", "ARMATURE").object = armature
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "source.blend"))
    given = [str(folder / "source.blend"), str(folder / "target.blend"), "-o", str(folder / "out.blend")]
    flags = [*QUICK, "--only", "vertex-groups", "--rig", "--map", str(folder / "map.npz")]
    assert main(["transfer", *given, *flags]) == 0
    assert "otherwise: those of 'Target', 'Target Eye' one after another" in capsys.readouterr().err
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    movers = {
        modifier.object
        for name in ("Target", "Target Eye")
        for modifier in bpy.data.objects[name].modifiers
        if modifier.type == "ARMATURE"
    }
    assert [x.type for x in bpy.data.objects].count("ARMATURE") == 1
    assert [x.data.bones.keys() for x in movers] == [["Jaw"]]


def test_what_was_carried_before_is_replaced(folder: Path) -> None:
    source, out = folder / "source.blend", folder / "out.blend"
    flags = [*QUICK, "--only", "vertex-groups"]
    assert main(["transfer", str(source), str(folder / "target.blend"), "-o", str(out), *flags]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(source))
    bpy.data.objects["Source"].vertex_groups["Jaw"].add(range(300), 0.7, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    assert main(["transfer", str(source), str(out), "-o", str(out), "--overwrite", *flags]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert bpy.data.objects["Target"].vertex_groups.keys() == ["Jaw"]
    assert weights(bpy.data.objects["Target"], "Jaw").max() == pytest.approx(0.7)


def test_textures_need_one_object(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = [str(folder / "source.blend"), str(folder / "target.blend"), "-o", str(folder / "out.blend")]
    assert main(["transfer", *given, "--only", "textures"]) == 1
    assert "has 2 mesh objects, and --only textures takes one: name it as" in capsys.readouterr().err
