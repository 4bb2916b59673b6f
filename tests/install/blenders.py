"""Blender's Python modules to install the zip into: each in a virtual environment of its own, without scipy."""

import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

PYTHON_AND_NUMPY = {
    "4.2.23": ("3.11", "1.24.3"),
    "4.5.15": ("3.11", "1.26.4"),
    "5.0.1": ("3.11", "1.26.4"),
    "5.1.2": ("3.13", "2.3.4"),
    "5.2.3": ("3.13", "2.3.4"),
}
"""Per module of Blender the Python it is for and the numpy that the application of that version brings."""

OLDEST, NEWEST = "4.2.23", "5.2.3"

ENVIRONMENTS = Path(tempfile.gettempdir(), f"mobius-blenders-{os.getuid() if hasattr(os, 'getuid') else 'user'}")


@cache
def interpreter(version: str) -> str:
    """Return a Python of a version, or skip the test where the machine has none."""
    name = f"python{version}"
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for found in [shutil.which(name), *sorted(versions.glob(f"{version}*/bin/{name}"), reverse=True)]:
        if found and subprocess.run([found, "-c", ""], capture_output=True, check=False).returncode == 0:
            return str(found)
    pytest.skip(f"no Python {version} on this machine")


@cache
def blender(version: str) -> str:
    """Return a Python with Blender's module and its numpy, and without scipy; made once and kept for later runs."""
    python, numpy = PYTHON_AND_NUMPY[version]
    uv = shutil.which("uv") or os.environ.get("UV")
    if uv is None:
        pytest.skip("uv, which makes the environments, is not on the path")
    environment = ENVIRONMENTS / f"bpy-{version}"
    executable = environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not (environment / "complete").exists():
        base = interpreter(python)
        for command in (
            [uv, "venv", "--quiet", "--clear", "--python", base, environment],
            [uv, "pip", "install", "--quiet", "--python", executable, f"bpy=={version}", f"numpy=={numpy}"],
        ):
            subprocess.run(command, check=True, timeout=500)
        (environment / "complete").touch()
    return str(executable)
