"""The program: its help, its output and nothing beside, with and without Blender's module."""

import signal
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


GUARDED = """
import importlib, importlib.util, os, signal, sys
from pathlib import Path
spec = importlib.util.spec_from_file_location("mobius_command", ROOT + "/__main__.py")
command = importlib.util.module_from_spec(spec)
spec.loader.exec_module(command)
command.load_extension()
streams = importlib.import_module(command.PACKAGE + ".mobius_addon.streams")
guarded = importlib.import_module(command.PACKAGE + ".mobius_addon.command_line").guarded
def run():
    RUN
sys.exit(guarded(run))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a run has no process of its own")
@pytest.mark.parametrize(
    ("code", "status", "said"),
    [
        ("return 0", 0, ""),
        ("return 1", 1, ""),
        ("with streams.reading(Path('a.usdc')): os.kill(os.getpid(), signal.SIGSEGV)", 2,
         "mobius: 'a.usdc' could not be read: it ends Blender (Segmentation fault), so it is damaged or too large\n"),
        ("with streams.reading(Path('x')): pass\n    os.kill(os.getpid(), signal.SIGABRT)", 134,
         "mobius: ended: Aborted\n"),
        ("signal.signal(signal.SIGINT, signal.SIG_DFL); os.kill(os.getpid(), signal.SIGINT)", 130, ""),
    ],
)  # fmt: skip
def test_a_crash_while_a_file_is_read_is_a_sentence(code: str, status: int, said: str) -> None:
    program_text = GUARDED.replace("ROOT", repr(str(ROOT))).replace("RUN", code)
    done = subprocess.run(
        [sys.executable, "-c", program_text], capture_output=True, text=True, timeout=60, check=False
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (status, said)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a run has no process of its own")
def test_a_run_ends_with_the_program(tmp_path: Path) -> None:
    code = "print(os.getpid(), flush=True); signal.pause()"
    program_text = GUARDED.replace("ROOT", repr(str(ROOT))).replace("RUN", code)
    with subprocess.Popen([sys.executable, "-c", program_text], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        child = int(running.stdout.readline())
        assert child != running.pid
        running.kill()
        # at the end of the last writer, not before
        assert running.stdout.read() == ""


STOPPED = """
import importlib, importlib.util, runpy, sys
sys.argv = [ROOT, "check", "x.obj"]
spec = importlib.util.spec_from_file_location("mobius_command", ROOT + "/__main__.py")
command = importlib.util.module_from_spec(spec)
spec.loader.exec_module(command)
command.load_extension()
def run(options):
    raise KeyboardInterrupt
importlib.import_module(command.PACKAGE + ".mobius_addon.command_line.check").run = run
runpy.run_path(ROOT + "/__main__.py", run_name="__main__")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a run has no process of its own")
def test_ctrl_c_ends_the_program_by_its_signal_so_that_a_loop_over_files_ends() -> None:
    text = STOPPED.replace("ROOT", repr(str(ROOT)))
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "mobius: stopped, nothing was written\n")
