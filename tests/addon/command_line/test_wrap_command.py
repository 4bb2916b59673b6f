"""`wrap`: the source on the target, in a scene or alone, by a search or by a map."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from commands import QUICK, run
from scenes import positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_wrap_writes_the_source_on_the_target(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, report, map_file = scans / "wrapped.blend", scans / "r.json", scans / "m.npz"
    inputs = scans / "source.blend", scans / "target.obj"
    before = [digest(path) for path in inputs]
    status, said, err = run(capsys, "wrap", *inputs, "-o", out, "--report", report, "--map", map_file, *QUICK)
    assert (status, err) == (0, "")
    assert f"{out}: " in said
    assert [digest(path) for path in inputs] == before
    assert json.loads(report.read_text())["fitted"]["folded"] == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert sorted(obj.name for obj in bpy.context.scene.objects) == ["Source on Target", "Target"]
    obj = bpy.data.objects["Source on Target"]
    assert len(obj.data.vertices) == 441
    assert "Right" in obj.vertex_groups
    assert np.abs(weights(obj, "Right") - (positions(obj)[:, 0] + 1) / 2).mean() < 0.03
    again = scans / "again.obj"
    status, _, err = run(capsys, "wrap", *inputs, "-o", again, "--use-map", map_file)
    assert status == 0
    lines = again.read_text().splitlines()
    assert sum(line.startswith("v ") for line in lines) == 441
    assert sum(line.startswith("f ") for line in lines) == 400


def test_the_targets_copy_with_the_key(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = scans / "key.blend"
    status, _, _ = run(capsys, "wrap", scans / "source.obj", scans / "target.obj", "-o", out, "--shape-key", *QUICK)
    assert status == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    found = [obj for obj in bpy.data.objects if obj.data.shape_keys]
    assert [len(obj.data.shape_keys.key_blocks) for obj in found] == [2]
    assert len(found[0].data.vertices) == 256


def test_inputs_are_not_written_over(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = scans / "target.obj"
    before = digest(target)
    status, _, err = run(capsys, "wrap", scans / "source.obj", target, "-o", target, *QUICK)
    assert status == 2
    assert "is read by this command" in err
    status, _, err = run(
        capsys, "wrap", scans / "source.obj", target, "-o", scans / "x.obj", "--use-map", scans / "no.npz"
    )
    assert status == 2
    assert "there is no file" in err
    assert digest(target) == before
