"""A sheet shows source and target with the same expressions."""

from pathlib import Path

import numpy as np
import pytest
from scenes import make_sheet, positions
from scipy.spatial.transform import Rotation

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.command_line.program import main  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.mobius_addon.sheet import chosen_keys, poses  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402

OPTIONS = ["--samples", "50", "--targets", "200", "--reflect", "never"]
KEYS = ("Wobble", "blink_L", "blink_R", "A", "B", "C", "D", "jawOpen")


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """A source with keys, of which each moves more than the one before, and a turned target."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    source, target = make_sheet("Source", 17), make_sheet("Target", 15)
    source.shape_key_add(name="Basis")
    for number, name in enumerate(KEYS, 1):
        key = source.shape_key_add(name=name, from_mix=False)
        for vertex, place in zip(key.points, positions(source), strict=True):
            vertex.co.z += 0.05 * number * np.exp(-4 * (place[:2] ** 2).sum())
    source.rotation_euler = (np.pi / 2, 0, 0)  # the camera looks along y
    target.rotation_euler, target.location = (1, 2, 3), (5, 0, 0)
    path = tmp_path / "pair.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_telling_expressions_come_first_then_what_moves_most(pair):
    source = bpy.data.objects["Source"]
    chosen = chosen_keys(source, [(name, name + ".001") for name in KEYS])
    assert [x for x, _ in chosen] == ["blink_L", "A", "B", "C", "D", "jawOpen"]
    assert all(other == name + ".001" for name, other in chosen)


def test_the_sheet_is_drawn_with_both_in_one_pose_and_nothing_of_it_is_left(pair, tmp_path):
    picture, out = tmp_path / "sheet.png", tmp_path / "out.blend"
    given = [f"{pair}:Source", f"{pair}:Target", "-o", str(out), "--sheet", str(picture), *OPTIONS]
    assert main(["transfer", *given]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    assert len(bpy.data.meshes) == len(bpy.data.objects) == 2
    assert not bpy.data.materials
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, 4)[:, :, :3]
    body = (pixels.max(axis=2) < 0.8)[round(height * 0.3 / 5.5) :]  # above the captions
    half = len(body) // 2
    below, above = body[:half], body[-half:]
    assert above.mean() > 0.1
    # the same shapes, in the same places
    assert (below != above).mean() < 0.1 * above.mean()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--sheet", "sheet.jpg"], "a sheet is a .png"),
        (["--sheet", "sheet.png", "--only", "uv"], "carry them too"),
    ],
)
def test_what_no_sheet_can_show_is_refused(pair, given, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["transfer", f"{pair}:Source", f"{pair}:Target", "-o", "out.blend", *given]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out.blend").exists()


def test_lips_that_close_are_shown_over_the_open_jaw() -> None:
    from mobius_extension.mobius_addon.sheet import together

    keys = [("Mouth_Close", "mouthClose"), ("jaw_open", "jawOpen"), ("eyeBlink_L", "eyeBlink_L")]
    assert together(keys[0], keys) == keys[:2]
    assert together(keys[0], keys[:1]) == keys[:1]
    assert together(keys[1], keys) == [keys[1]]
    assert together(keys[2], keys) == [keys[2]]


@pytest.mark.parametrize("reflected", [False, True])
def test_the_target_is_held_as_the_source_or_as_its_mirror_image(pair: Path, reflected: bool) -> None:
    source, target = bpy.data.objects["Source"], make_sheet("Copy", 17)
    turn = Rotation.from_euler("xyz", (2, 1, 3))
    rest = positions(source)
    own = rest * [-1, 1, 1] if reflected else rest
    target.data.vertices.foreach_set("co", (3 * turn.apply(own)).astype(np.float32).ravel())
    if reflected:
        target.data.flip_normals()
    bpy.context.view_layer.update()
    surfaces = read_surface(source), read_surface(target)
    faces, size = surfaces[0].rest.faces, len(rest)
    corner = np.unique(faces, return_index=True)[1]
    sure = np.ones(size)
    found = Correspondence(corner // 3, np.eye(3)[corner % 3], sure > 0, sure, faces, size)
    held = [one.apply(x.rest.vertices) for one, x in zip(poses(source, surfaces, found), surfaces, strict=True)]
    assert np.abs(held[1] / 3 - held[0] * [-1 if reflected else 1, 1, 1]).max() < 1e-5
