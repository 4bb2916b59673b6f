"""Commands run in this process, and as a program of their own."""

import subprocess
import sys
from pathlib import Path

import pytest
from mobius_extension.mobius_addon.command_line import main

ROOT = Path(__file__).resolve().parents[3]
QUICK = ["--samples", "50", "--targets", "200", "--reflect", "never", "--refine", "none"]


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """Exit status, standard output and errors of one command."""
    capsys.readouterr()
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


def program(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT), *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
