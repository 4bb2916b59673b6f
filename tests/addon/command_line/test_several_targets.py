"""`transfer` to several targets: each with files of its own, or named."""

from pathlib import Path

import numpy as np
import pytest
from commands import QUICK, run
from scenes import positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")


def test_transfer_to_several_targets(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that cannot be done is named and the others are done."""
    results = scans / "results"
    results.mkdir()
    second, ball = scans / "second.obj", scans / "ball.obj"
    second.write_bytes((scans / "target.obj").read_bytes())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add()
    bpy.ops.wm.obj_export(filepath=str(ball), export_materials=False)
    targets = [scans / "target.obj", ball, second]
    status, out, err = run(
        capsys, "transfer", scans / "source.blend", *targets, "-o", results, "--map", results, "--report", results,
        "--only", "vertex-groups", *QUICK,
    )  # fmt: skip
    assert status == 1
    assert err.startswith(f"mobius: {ball}: ")
    assert "closed" in err
    for name in ("target", "second"):
        assert f"{results / name}.blend: 1 vertex group from" in out
    names = {f"{name}.{kind}" for name in ("target", "second") for kind in ("blend", "npz", "json")}
    assert {x.name for x in results.iterdir()} == names
    bpy.ops.wm.open_mainfile(filepath=str(results / "second.blend"))
    obj = bpy.context.scene.objects[0]
    assert np.median(np.abs(weights(obj, "Right") - (positions(obj)[:, 0] + 1) / 2)) < 0.05


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["-o", "{}/new"], "'{}/new' is no folder, which several targets need"),
        (["-o", "{}", "--use-map", "{}/m.npz"], "--use-map is about one target"),
        (["-o", "{}", "--report", "{}/r.json"], "--report '{}/r.json' is no folder"),
    ],
)
def test_several_targets_need_folders(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], said: str
) -> None:
    given = [x.format(tmp_path) for x in flags]
    status, _, err = run(capsys, "transfer", "source.obj", "a.obj", "b.obj", *given)
    assert status == 2
    assert said.format(tmp_path) in err


def test_two_targets_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "transfer", "source.obj", "x/a.obj", "y/a.ply", "-o", tmp_path)
    assert (status, list(tmp_path.iterdir())) == (2, [])
    assert "would both be written to" in err
