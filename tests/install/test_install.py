"""The zip, installed into Blenders that have no scipy: it works, and leaves nothing behind when it is removed."""

import os
import subprocess
import zipfile
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


@pytest.mark.parametrize("version", [OLDEST, NEWEST])
def test_where_no_scipy_fits_the_extension_says_so(version: str, built: Path, tmp_path: Path) -> None:
    """As on a Python that the zip brings nothing for."""
    path = tmp_path / "without-scipy.zip"
    with zipfile.ZipFile(built) as full, zipfile.ZipFile(path, "w") as archive:
        for name in full.namelist():
            if name == "blender_manifest.toml":
                lines = full.read(name).decode().splitlines()
                archive.writestr(name, "\n".join(line for line in lines if not line.startswith('    "./wheels/scipy')))
            elif "scipy" not in name:
                archive.writestr(name, full.read(name))
    user = tmp_path / "user"
    user.mkdir()
    done = in_blender(version, "install_without_scipy.py", user, path)
    assert "SAID SO" in done.stdout, done.stdout + done.stderr
    assert "'scipy' cannot be loaded: No module named 'scipy'" in done.stderr
    assert "Traceback" not in done.stderr
