"""`transfer --only textures`: pictures beside the file that shows them, packed into it, or written by an exporter."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import QUICK, run
from scenes import make_sheet

bpy: Any = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.textures.images import new_image, read_tiles  # noqa: E402
from mobius_extension.solver.carry.textures import exr_bytes  # noqa: E402

COLOR = (200, 40, 90)


@pytest.fixture
def painted(tmp_path: Path) -> Path:
    """A folder with a sheet of one color as .blend, and another sheet as .obj."""
    source = make_sheet("Source", 21)
    layer = source.data.uv_layers.new(name="UVMap")
    flat = np.array([source.data.vertices[loop.vertex_index].co[:2] for loop in source.data.loops])
    layer.uv.foreach_set("vector", (flat / 2 + 0.5).astype(np.float32).ravel())
    made = bpy.data.materials.new("Skin")
    made.use_nodes = True
    node = made.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = new_image("Skin", {1001: np.full((64, 64, 3), COLOR, np.uint8)}, "sRGB")
    shader = next(x for x in made.node_tree.nodes if x.type == "BSDF_PRINCIPLED")
    made.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    source.data.materials.append(made)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "source.blend"))
    files.new_scene()
    files.export_mesh(make_sheet("Target", 16), tmp_path / "target.obj")
    (tmp_path / "target.mtl").unlink(missing_ok=True)
    files.new_scene()
    return tmp_path


def arguments(folder: Path, out: str, *more: object) -> list[object]:
    return [
        "transfer", folder / "source.blend", folder / "target.obj", "-o", folder / out, "--only", "textures",
        "--texture-size", "64", *more, *QUICK,
    ]  # fmt: skip


def shown(path: Path) -> Any:
    """The picture that the material of the only mesh of a file reads."""
    if path.suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    else:
        files.new_scene()
        files.import_mesh(str(path))
    obj = next(x for x in bpy.data.objects if x.type == "MESH")
    nodes = obj.material_slots[0].material.node_tree.nodes
    return next(x.image for x in nodes if x.type == "TEX_IMAGE" and x.image is not None)


def color_of(image: Any) -> list[int]:
    return np.median(read_tiles(image)[1001][:, :, :3], axis=(0, 1)).astype(int).tolist()


def test_beside_a_blend_in_a_folder_of_their_own(painted: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, *arguments(painted, "out.blend"))
    assert (status, err) == (0, "")
    assert "1 texture from" in out
    folder = painted / "out_textures"
    assert [x.name for x in folder.iterdir()] == ["Target_Base_Color.png"]
    first = (folder / "Target_Base_Color.png").read_bytes()
    image = shown(painted / "out.blend")
    assert image.filepath == "//out_textures/Target_Base_Color.png"
    assert image.packed_file is None
    assert color_of(image) == list(COLOR)
    # again: what is there and the same is taken; what is there and another is left alone
    (painted / "out.blend").unlink()
    assert run(capsys, *arguments(painted, "out.blend"))[0] == 0
    assert [x.name for x in folder.iterdir()] == ["Target_Base_Color.png"]
    (folder / "Target_Base_Color.png").write_bytes(b"mine")
    assert run(capsys, *arguments(painted, "out.blend"))[0] == 0
    assert (folder / "Target_Base_Color.png").read_bytes() == b"mine"
    assert (folder / "Target_Base_Color.001.png").read_bytes() == first
    assert shown(painted / "out.blend").filepath == "//out_textures/Target_Base_Color.001.png"
    assert not [x for x in painted.iterdir() if x.name.startswith(".mobius")]


def test_packed(painted: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, *arguments(painted, "out.blend", "--pack-textures", "--texture-mask"))[0] == 0
    assert not (painted / "out_textures").exists()
    image = shown(painted / "out.blend")
    assert image.packed_file is not None
    assert color_of(image) == list(COLOR)
    assert "Target Unmatched" in bpy.data.images


@pytest.mark.parametrize("ending", ["glb", "obj", "fbx", "gltf"])
def test_other_formats_bring_the_picture_along(painted: Path, ending: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, *arguments(painted, f"out.{ending}"))
    assert status == 0, err
    assert color_of(shown(painted / f"out.{ending}")) == list(COLOR)


def test_a_transfer_map_is_kept(painted: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = painted / "map.exr"
    status, _, err = run(capsys, *arguments(painted, "out.blend", "--texture-map", path))
    assert (status, err) == (0, "")
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    u, v, number, confidence = read_tiles(image)[1001].transpose(2, 0, 1)
    assert image.size[:] == (64, 64)
    assert (number == 0).mean() > 0.95
    for values in (u, v):
        assert values.min() >= 0
        assert values.max() <= 1
    assert (confidence[number == 0] > 0).mean() > 0.9
    # and used for the picture that the source has now
    through = [
        "transfer", painted / "source.blend", painted / "out.blend", "-o", painted / "again.blend",
        "--only", "textures", "--use-texture-map",
    ]  # fmt: skip
    status, out, err = run(capsys, *through, path)
    assert (status, err) == (0, "")
    assert "matched" not in out
    assert color_of(shown(painted / "again.blend")) == list(COLOR)
    (painted / "again.blend").unlink()
    for wrong, words in ((painted / "no.exr", "there is no file"), (painted / "out_textures", "there is no file")):
        status, _, err = run(capsys, *through, wrong)
        assert status in (1, 2)
        assert words in err
        assert not (painted / "again.blend").exists()


def test_a_transfer_map_carries_normals_and_transparency_as_the_transfer_did(
    painted: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the target's layout turned and the source's mirrored."""
    bpy.ops.wm.open_mainfile(filepath=str(painted / "source.blend"))
    obj = bpy.data.objects["Source"]
    for corner in obj.data.uv_layers["UVMap"].uv:
        corner.vector.x = 1 - corner.vector.x
    tree = obj.material_slots[0].material.node_tree
    shader = next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED")
    y, x = np.mgrid[:64, :64] / 63.0
    color = np.stack([200 + 0 * x, 40 + 100 * x, 90 + 50 * y, 255 - 155 * x], axis=2).astype(np.uint8)
    slopes = np.stack([0.5 + 0.3 * x, 0.5 - 0.2 * y, 0.9 + 0 * x], axis=2)
    node = next(x for x in tree.nodes if x.type == "TEX_IMAGE")
    node.image = new_image("Color", {1001: color}, "sRGB")
    tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
    read, bumps = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    read.image = new_image("Slopes", {1001: np.round(255 * slopes).astype(np.uint8)}, "Non-Color")
    tree.links.new(read.outputs["Color"], bumps.inputs["Color"])
    tree.links.new(bumps.outputs["Normal"], shader.inputs["Normal"])
    bpy.ops.wm.save_as_mainfile(filepath=str(painted / "source.blend"))
    files.new_scene()
    path = painted / "map.exr"
    status, _, err = run(capsys, *arguments(painted, "out.blend", "--texture-map", path))
    assert (status, err) == (0, "")
    through = [
        "transfer", painted / "source.blend", painted / "out.blend", "-o", painted / "again.blend",
        "--only", "textures", "--use-texture-map", path,
    ]  # fmt: skip
    status, out, err = run(capsys, *through)
    assert (status, err) == (0, "")
    assert "2 textures" in out
    pictures = []
    for name in ("out.blend", "again.blend"):
        bpy.ops.wm.open_mainfile(filepath=str(painted / name))
        obj = next(x for x in bpy.data.objects if x.type == "MESH")
        tree = obj.material_slots[0].material.node_tree
        shader = next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED")
        assert shader.inputs["Alpha"].links[0].from_socket.name == "Alpha"
        pictures.append({x.label: read_tiles(x.image)[1001].astype(int) for x in tree.nodes if x.type == "TEX_IMAGE"})
    assert sorted(pictures[0]) == sorted(pictures[1]) == ["Base Color", "Normal"]
    for label, first in pictures[0].items():
        assert np.ptp(first, axis=(0, 1))[[0, 3][label == "Base Color"]] > 50
        apart = np.abs(first - pictures[1][label])
        assert np.percentile(apart, 98) <= 2, label
    # without what is kept beside it, a warning; with another map's, a refusal
    beside = painted / "map_normals.exr"
    beside.unlink()
    (painted / "again.blend").unlink()
    status, out, err = run(capsys, *through)
    assert status == 0
    assert "Normal is not carried: beside the transfer map there is no" in err
    assert "1 texture " in out
    beside.write_bytes(exr_bytes(np.zeros((32, 32, 4), np.float32)))
    (painted / "again.blend").unlink()
    status, _, err = run(capsys, *through)
    assert status == 1
    assert "does not belong to" in err
    assert not (painted / "again.blend").exists()


def test_nothing_is_written_on_failure(painted: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(x.name for x in painted.rglob("*"))
    for more, words in (
        (["--texture-size", "8"], "the size of textures lies from 16 to 16384"),
        (["--texture-layout", "own"], "'Target' has no UV map"),
        (["--only", "uv", "--texture-map", painted / "m.exr"], "--texture-map is made with textures"),
    ):
        status, _, err = run(capsys, *arguments(painted, "out.blend", *more))
        assert status in (1, 2)
        assert words in err
        assert sorted(x.name for x in painted.rglob("*")) == before
