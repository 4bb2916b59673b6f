"""Every command of docs/headless/README.md runs as it stands there, in a copy of the folders that it names."""

import csv
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from blenders import NEWEST, OLDEST, blender
from zips import ROOT

from solver.search.kernels.build_wheel import this_platform

PAGE = (ROOT / "docs/headless/README.md").read_text(encoding="utf-8")


def commands(start: str) -> list[list[str]]:
    """The page's commands that begin with some words, split as a shell does, in their order."""
    lines = [line.strip() for line in PAGE.splitlines() if line.startswith("    ")]
    return [shlex.split(line) for line in lines if line.startswith(start)]


def run(command: list[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}
    return subprocess.run(
        command, cwd=folder, env=kept | environment, capture_output=True, text=True, check=False, timeout=400
    )


def succeed(command: list[str], folder: Path, **environment: str) -> str:
    done = run(command, folder, **environment)
    assert done.returncode == 0, f"{command}:\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder as the project's after `python . build`, where outputs do no harm."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("solver", "mobius_addon", "release", "docs", "__main__.py", "__init__.py", "blender_manifest.toml"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "dist").mkdir()
    # the page names the zip of one platform
    shutil.copy(built, folder / "dist" / built.name.replace(this_platform().replace("-", "_"), "linux_x64"))
    return folder


def test_the_page_names_the_version_that_is_built(built: Path) -> None:
    assert built.name.replace(this_platform().replace("-", "_"), "linux_x64") in PAGE


def test_every_command_of_the_page_is_run_here() -> None:
    kinds = ("uv run python docs/headless/", "uv run python . ", "python docs/headless/", "blender --")
    assert sum(len(commands(kind)) for kind in kinds) == len(commands("")) >= 10
    scripts = {part for line in commands("") for part in line if part.startswith("docs/")}
    assert scripts == {f"docs/headless/{path.name}" for path in (ROOT / "docs/headless").glob("*.py")}


def test_arrays(folder: Path) -> None:
    (command,) = commands("uv run python docs/headless/arrays.py")
    out = succeed([sys.executable, *command[3:]], folder)
    assert ", certified\n" in out
    assert float(out.partition("off by ")[2].split()[0]) < 0.02


def test_commands_of_the_sources(folder: Path) -> None:
    for command in commands("uv run python . "):
        if command[4] != "build":  # the fixture `built` has run it
            succeed([sys.executable, *command[3:]], folder)


@pytest.mark.parametrize("version", [OLDEST, NEWEST])
def test_blenders_module_and_the_batch(version: str, folder: Path, tmp_path: Path) -> None:
    for command in commands("python docs/headless/"):
        out = succeed([blender(version), *command[1:]], folder, BLENDER_USER_RESOURCES=str(tmp_path))
    assert "certified: True" in out
    assert "on the target: ['Mobius Matched', 'Hill'], ['UVMap', 'Mobius', 'UVMap.001']" in out
    if version != OLDEST:
        return  # the older Blender that runs the tests cannot read its file
    (command,) = commands("uv run python docs/headless/batch.py")
    succeed([sys.executable, *command[3:]], folder)
    assert (folder / "out/two_objects-Target.blend").exists()
    with (folder / "out/batch.csv").open(newline="") as table:
        (row,) = csv.DictReader(table)
    assert (row["status"], row["certified"]) == ("0", "True")
    made = (folder / "out/two_objects-Target.blend").stat().st_mtime_ns
    done = run([sys.executable, *command[3:5], "no.obj", *command[5:]], folder)
    assert done.returncode == 1
    assert "no.obj: mobius: there is no file 'no.obj'" in done.stdout
    assert (folder / "out/two_objects-Target.blend").stat().st_mtime_ns == made


def test_an_installed_blender(folder: Path, tmp_path: Path) -> None:
    """MOBIUS_BLENDER is the command that starts a Blender, with options if it needs any."""
    start = shlex.split(os.environ.get("MOBIUS_BLENDER", "")) or [shutil.which("blender") or ""]
    if not start[0]:
        pytest.skip("no Blender: set MOBIUS_BLENDER to the command that starts it")
    environment = {"BLENDER_USER_RESOURCES": str(tmp_path)}
    for command in commands("blender --"):
        succeed([*start, *command[1:]], folder, **environment)
    assert (folder / "carried.blend").exists()
    for status, arguments in (
        (1, ["align", "two_objects.blend:Source", "two_objects.blend:Source"]),
        (2, ["align", "no.obj", "two_objects.blend:Target"]),
        (2, ["dance"]),
    ):
        assert run([*start, "--command", "mobius", *arguments], folder, **environment).returncode == status
