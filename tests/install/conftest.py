"""The zip of this platform, made as a person makes it."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def build(folder: Path, *platforms: str) -> list[Path]:
    """Run `python . build` and return the zips."""
    done = subprocess.run(
        [sys.executable, str(ROOT), "build", *platforms, "-o", str(folder)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    zips = [Path(line.rpartition(": ")[0]) for line in done.stdout.splitlines()]
    assert sorted(folder.iterdir()) == sorted(zips)
    return zips


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip for this platform."""
    from solver.kernels.build_wheel import this_platform

    (path,) = build(tmp_path_factory.mktemp("dist"), this_platform())
    return path
