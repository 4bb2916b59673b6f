"""Real surfaces for the solver's tests, read without Blender."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gif import read_gif
from mesh_files import read_mesh

from solver import TriangleMesh

DATA = Path(os.environ.get("MOBIUS_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))


@pytest.fixture(scope="session")
def data_path() -> Callable[[str], Path]:
    """Return the path of a file of real data, or skip the test where it is absent."""

    def path(relative: str) -> Path:
        if not (DATA / relative).exists():
            pytest.skip(f"real data '{relative}' is absent: set MOBIUS_DATA to the folder that holds it")
        return DATA / relative

    return path


@pytest.fixture(scope="session")
def real_mesh(data_path: Callable[[str], Path]) -> Callable[[str], TriangleMesh]:
    """Load an .obj or .ply file of the real data by its relative path, as in ``real_mesh("teeth/K04.obj")``."""

    @cache
    def load(relative: str) -> TriangleMesh:
        return read_mesh(data_path(relative))

    return load


@pytest.fixture(scope="session")
def silhouette(data_path: Callable[[str], Path]) -> Callable[[str], np.ndarray]:
    """Load a silhouette, as in ``silhouette("car-01.gif")``: (height, width) bool, True inside."""
    return lambda name: read_gif(data_path(f"silhouettes/{name}")) > 127
