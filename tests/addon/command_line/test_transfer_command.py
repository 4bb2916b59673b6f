"""`transfer`: what it carries into a file, and through which map."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import QUICK, run
from scenes import corner_values, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402


def test_transfer_carries_everything_into_a_blend(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out_file = scans / "out.blend"
    # Blender 4.2 imports a file without normals as flat, which the source is too; later ones as smooth
    smooth = any(polygon.use_smooth for polygon in files.import_mesh(str(scans / "target.obj")).obj.data.polygons)
    arguments = ["-o", out_file, "--report", scans / "r.json", "--map", scans / "m.npz", *QUICK]
    status, out, err = run(capsys, "transfer", scans / "source.blend", scans / "target.obj", *arguments)
    assert (status, err) == (0, "")
    carried = "1 vertex group, 1 UV map" + (", 1 smooth flag" if smooth else "")
    assert f"{out_file}: {carried} from {scans / 'source.blend'}" in out
    assert json.loads((scans / "r.json").read_text())["transferred"] == [
        {"kind": "vertex-groups", "source": "Right", "target": "Right"},
        *([{"kind": "smoothness", "source": "sharp_face", "target": "sharp_face"}] if smooth else []),
        {"kind": "uv", "source": "UVMap", "target": "UVMap"},
    ]
    bpy.ops.wm.open_mainfile(filepath=str(out_file))
    assert bpy.context.scene.objects.keys() == ["Target"]
    target = bpy.context.scene.objects["Target"]
    x = positions(target)[:, 0]
    assert np.median(np.abs(weights(target, "Right") - (x + 1) / 2)) < 0.05

    # the same through the map that was written: no second search, the same weights
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", scans / "target.obj",
        "-o", scans / "again.blend", "--use-map", scans / "m.npz", "--only", "vertex-groups",
    )  # fmt: skip
    assert (status, err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(out_file))
    first = weights(bpy.data.objects["Target"], "Right")
    bpy.ops.wm.open_mainfile(filepath=str(scans / "again.blend"))
    again = bpy.data.objects["Target"]
    assert (weights(again, "Right") == first).all()
    assert len(again.data.uv_layers) == 0


def test_transfer_says_what_a_format_cannot_hold(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", scans / "target.obj", "-o", scans / "out.obj", *QUICK
    )  # fmt: skip
    assert status == 0
    assert (
        err == f"mobius: warning: '{scans / 'out.obj'}' is without vertex group 'Right': write a .blend to keep all\n"
    )


def test_every_choice_of_a_transfer_is_a_flag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = make_sheet("Source", 16), make_sheet("Target", 14)
    for obj, weight in ((source, 0.5), (target, 0.25)):
        for name in ("Head", "Head 2", "Neck"):
            obj.vertex_groups.new(name=name).add(range(len(obj.data.vertices)), weight, "REPLACE")
    right = [v.index for v in target.data.vertices if v.co.x > 0]
    target.vertex_groups.new(name="Right").add(right, 1.0, "REPLACE")
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, out, err = run(
        capsys, "transfer", f"{path}:Source", f"{path}:Target", "-o", tmp_path / "out.blend", "--report",
        tmp_path / "r.json", "--only", "vertex-groups", "--names", "Head*", "--mix", "add", "--mix-factor", "0.5",
        "--target-mask", "Right", "--invert-target-mask", "--unmatched", "fill", "--smallest-weight", "0.01",
        "--limit", "4", "--evaluated", *QUICK,
    )  # fmt: skip
    assert status == 0, err
    assert "2 vertex groups from" in out
    assert set(json.loads((tmp_path / "r.json").read_text())["unmatched"]) == {"vertices", "area", "outcome", "bare"}
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    obj = bpy.data.objects["Target"]
    expected = np.where(np.isin(np.arange(len(obj.data.vertices)), right), 0.25, 0.5)
    for name in ("Head", "Head 2"):
        assert weights(obj, name) == pytest.approx(expected, abs=1e-5)
    assert weights(obj, "Neck") == pytest.approx(0.25)
    status, _, err = run(
        capsys, "transfer", f"{path}:Source", f"{path}:Target", "-o", tmp_path / "both.blend",
        "--only", "vertex-groups", "--collisions", "number", "--active", "--normalize", *QUICK,
    )  # fmt: skip
    assert status == 0, err
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "both.blend"))
    assert len(bpy.data.objects["Target"].vertex_groups) == 5


def test_two_objects_of_one_blend(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("Scan", 16).vertex_groups.new(name="Head").add(range(256), 0.5, "REPLACE")
    make_sheet("Scan.001", 14)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, _, err = run(
        capsys, "transfer", f"{path}:Scan", f"{path}:Scan.001", "-o", tmp_path / "out.blend", *QUICK
    )  # fmt: skip
    assert (status, err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert bpy.data.objects.keys() == ["Scan", "Scan.001"]
    assert np.allclose(weights(bpy.data.objects["Scan.001"], "Head"), 0.5)


def reordered(obj_file: Path, path: Path) -> Path:
    """Write the surface of an .obj with its vertices in another order."""
    lines = [line.split() for line in obj_file.read_text().splitlines() if line.startswith(("v ", "f "))]
    vertices = [" ".join(words) for words in lines if words[0] == "v"]
    order = np.random.default_rng(0).permutation(len(vertices))
    new = np.argsort(order) + 1
    faces = [[new[int(word.split("/")[0]) - 1] for word in words[1:]] for words in lines if words[0] == "f"]
    texts = [vertices[k] for k in order] + [f"f {' '.join(map(str, face))}" for face in faces]
    path.write_text("\n".join(texts) + "\n")
    return path


def test_a_map_of_other_meshes_is_refused(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target, map_file = scans / "source.obj", scans / "target.obj", scans / "m.npz"
    assert run(capsys, "align", source, target, "--map", map_file, *QUICK)[0] == 0
    common = ["-o", scans / "o.blend", "--use-map", map_file]
    status, _, err = run(capsys, "transfer", target, source, *common)
    assert (status, err) == (2, f"mobius: '{map_file}' was made for a source of 800 faces, but '{target}' has 450\n")
    status, _, err = run(capsys, "transfer", source, scans / "hole.obj", *common)
    assert status == 2
    assert f"was made for a target of 256 vertices, but '{scans / 'hole.obj'}' has 36" in err
    for role, obj_file in (("source", source), ("target", target)):
        other = reordered(obj_file, scans / "reordered.obj")
        pair = [other if x == role else y for x, y in (("source", source), ("target", target))]
        status, _, err = run(capsys, "transfer", *pair, *common)
        assert status == 2
        assert f"'{map_file}' was made for another {role} than '{other}', or for this one before its vertices" in err
    assert not (scans / "o.blend").exists()


def test_a_damaged_map_is_a_sentence(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target, map_file = scans / "source.obj", scans / "target.obj", scans / "m.npz"
    assert run(capsys, "align", source, target, "--map", map_file, *QUICK)[0] == 0
    map_file.write_bytes(map_file.read_bytes()[:-100])
    status, _, err = run(capsys, "transfer", source, target, "-o", scans / "o.blend", "--use-map", map_file)
    assert status == 2
    assert f"mobius: '{map_file}' is not a map that this program wrote, or it is damaged" in err


def textured_target(path: Path) -> np.ndarray:
    """Save a target whose material uses a UV map of its own under the source's name, and return that map."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = make_sheet("Cloth", 16)
    uv = np.random.default_rng(0).random((len(obj.data.loops), 2)).astype(np.float32)
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())
    obj.data.materials.append(bpy.data.materials.new("Own"))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return uv


def test_the_target_keeps_its_own_uv_map_and_a_second_run_adds_nothing(
    scans: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = textured_target(scans / "cloth.blend")
    said = "mobius: warning: 'Cloth' keeps its own UV map ('UVMap'): carried as 'UVMap.001'\n"
    given = scans / "cloth.blend"
    for out in (scans / "first.blend", scans / "second.blend"):
        status, _, err = run(capsys, "transfer", scans / "source.blend", given, "-o", out, "--only", "uv", *QUICK)
        assert (status, err) == (0, said)
        bpy.ops.wm.open_mainfile(filepath=str(out))
        layers = bpy.data.objects["Cloth"].data.uv_layers
        assert layers.keys() == ["UVMap", "UVMap.001"]
        assert (corner_values(bpy.data.objects["Cloth"], "UVMap") == own).all()
        assert (layers.active.name, [x.name for x in layers if x.active_render]) == ("UVMap", ["UVMap"])
        given = out
    out = scans / "third.blend"
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", given, "-o", out, "--only", "uv", "--collisions", "replace", *QUICK
    )
    assert (status, err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert np.abs(corner_values(bpy.data.objects["Cloth"], "UVMap") - own).max() > 0.1
