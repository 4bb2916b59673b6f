"""`python . build`, as a program and as a module."""

import importlib
import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def run_build(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run `python . build`."""
    command = [sys.executable, ROOT, "build", *arguments]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, timeout=550)


def build(folder: Path, *platforms: str) -> list[Path]:
    """Make zips in an empty folder and return them."""
    done = run_build(*platforms, "-o", folder)
    assert done.returncode == 0, done.stderr
    zips = [Path(line.rpartition(": ")[0]) for line in done.stdout.splitlines()]
    assert sorted(folder.iterdir()) == sorted(zips)
    return zips


def build_module() -> Any:
    """`release.build`, loaded as `python .` loads it."""
    name = "mobius_extension"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location("mobius_command", ROOT / "__main__.py")
        assert spec is not None
        assert spec.loader is not None
        command = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(command)
        command.load_extension()
    return importlib.import_module(f"{name}.release.build")
