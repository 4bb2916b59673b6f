"""The zip, installed into Blenders that have no scipy: it works, and leaves nothing behind when it is removed."""

import os
import subprocess
from pathlib import Path

import pytest
from blenders import NEWEST, OLDEST, PYTHON_AND_NUMPY, blender

HERE = Path(__file__).parent


def in_blender(version: str, script: str, user: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a script with Blender's module and an empty folder for the user."""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}
    return subprocess.run(
        [blender(version), str(HERE / script), *map(str, arguments)], cwd=user,
        env=environment | {"BLENDER_USER_RESOURCES": str(user)},
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip


@pytest.mark.parametrize(
    "version",
    [v if v in (OLDEST, NEWEST) else pytest.param(v, marks=pytest.mark.matrix) for v in PYTHON_AND_NUMPY],
)
def test_install_use_and_remove(version: str, built: Path, tmp_path: Path) -> None:
    done = in_blender(version, "use_installed.py", tmp_path, built)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "INSTALLED, USED AND REMOVED" in done.stdout
    assert "Traceback" not in done.stderr
