"""`check`: a line for each mesh."""

import math
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


def test_check_says_what_will_be_done_about_a_mesh(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "check", scans / "hole.obj", scans / "parts.obj")
    assert (status, err) == (0, "")
    assert "hole.obj: disc, 36 vertices, boundary of 20 edges; for the computation: 1 opening (4 edges) closed" in out
    assert "; for the computation: 1 smaller part aligned beside it" in out.splitlines()[1]


def test_check_exits_1_for_what_can_be_no_disc_and_2_for_what_is_unreadable(
    scans: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    corners = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    (scans / "cube.obj").write_text(
        "\n".join([*corners, "f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"])
    )
    (scans / "line.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    status, out, err = run(capsys, "check", scans / "cube.obj", scans / "line.obj", scans / "target.obj")
    assert (status, err) == (1, "")
    assert "cube.obj: closed, 8 vertices: goes to the sphere" in out
    assert "line.obj: cannot be used: it has only faces without area" in out
    assert len(out.splitlines()) == 3
    status, out, err = run(capsys, "check", scans / "gone.obj", scans / "target.obj")
    assert status == 2
    assert err == f"mobius: there is no file '{scans / 'gone.obj'}'\n"
    assert len(out.splitlines()) == 1


def band(length: int, rows: int = 7) -> str:
    """An .obj file of a wavy band, so many times as long as wide."""
    columns = (rows - 1) * length + 1
    places = [(i / (rows - 1), j / (rows - 1)) for j in range(rows) for i in range(columns)]
    corners = [(j * columns + i + 1, (j + 1) * columns + i + 1) for j in range(rows - 1) for i in range(columns - 1)]
    lines = [f"v {x:.6f} {y:.6f} {0.1 * math.sin(2 * x):.6f}" for x, y in places]
    return "\n".join([*lines, *(f"f {a} {a + 1} {b + 1} {b}" for a, b in corners)])


def test_check_says_before_aligning_what_a_disc_holds_badly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for length in (6, 12, 20):
        (tmp_path / f"{length}.obj").write_text(band(length))
    status, out, err = run(capsys, "check", *(tmp_path / f"{length}.obj" for length in (6, 12, 20)))
    good, less, not_at_all = out.splitlines()
    assert (status, err) == (1, "")
    assert "narrow" not in good
    assert ": disc, " in less
    assert "; long and narrow: less exact, as angles are lost along " in less
    assert "20.obj: cannot be used: it is too long and narrow to be aligned in a disc" in not_at_all
    assert not_at_all.endswith("cut it into pieces that are at most eight times as long as wide")


def test_check_prints_every_object_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("One", 4)
    make_sheet("Two", 5)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, out, _ = run(capsys, "check", path)
    assert status == 0
    assert [line.split(": disc")[0] for line in out.splitlines()] == [f"{path}:One", f"{path}:Two"]
    assert run(capsys, "check", f"{path}:Two")[1].startswith(f"{path}:Two: disc, 25 vertices")
