"""The program: its help, its output and nothing beside, with and without Blender's module."""

import subprocess
import sys
from pathlib import Path

import pytest
from commands import ROOT, listing, program, run


def test_help_needs_no_mesh(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "--help")
    assert status == 0
    assert all(name in out for name in ("demo", "check", "flatten", "align", "transfer"))


def test_the_program_says_its_result_and_nothing_else(scans: Path) -> None:
    done = program("check", "source.blend", "hole.obj", cwd=scans)
    assert done.returncode == 0
    assert done.stderr == ""
    assert done.stdout.splitlines() == [
        "source.blend: disc, 441 vertices, boundary of 80 edges",
        "hole.obj: disc, 36 vertices, boundary of 20 edges; for the computation: 1 opening (4 edges) closed",
    ]


def test_the_program_refuses_with_one_line(scans: Path) -> None:
    before = listing(scans)
    done = program("align", "gone.obj", "target.obj", "--map", "m.npz", cwd=scans)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "mobius: there is no file 'gone.obj'\n"
    assert listing(scans) == before


def test_without_blenders_module_there_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "bpy.py").write_text("raise ModuleNotFoundError(\"No module named 'bpy'\", name='bpy')\n")
    code = f"import sys, runpy; sys.path.insert(0, {str(tmp_path)!r}); sys.argv = ['.', 'check', 'x.obj']; "
    code += f"runpy.run_path({str(ROOT / '__main__.py')!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("mobius: the Python package 'bpy' is missing or not for this Python")
    assert "Traceback" not in done.stderr
