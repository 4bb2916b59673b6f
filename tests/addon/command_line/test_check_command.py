"""`check`: a line for each mesh."""

from pathlib import Path

import pytest
from commands import run
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")


def test_check_prints_a_line_per_mesh(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = scans / "source.blend", scans / "target.obj"
    status, out, err = run(capsys, "check", source, target)
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        f"{source}: disc, 441 vertices, boundary of 80 edges",
        f"{target}: disc, 256 vertices, boundary of 60 edges",
    ]


def test_check_exits_1_for_what_is_no_disc_and_2_for_what_is_unreadable(
    scans: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, err = run(capsys, "check", scans / "hole.obj", scans / "parts.obj", scans / "target.obj")
    assert (status, err) == (1, "")
    assert "hole.obj: not a disc: it has 2 boundary loops (20 and 4 edges)" in out
    assert "parts.obj: not a disc: it has 2 separate parts" in out
    assert len(out.splitlines()) == 3
    status, out, err = run(capsys, "check", scans / "gone.obj", scans / "target.obj")
    assert status == 2
    assert err == f"mobius: there is no file '{scans / 'gone.obj'}'\n"
    assert len(out.splitlines()) == 1


def test_check_prints_every_object_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("One", 4)
    make_sheet("Two", 5)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, out, _ = run(capsys, "check", path)
    assert status == 0
    assert [line.split(": disc")[0] for line in out.splitlines()] == [f"{path}:One", f"{path}:Two"]
    assert run(capsys, "check", f"{path}:Two")[1].startswith(f"{path}:Two: disc, 25 vertices")
