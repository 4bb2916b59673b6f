"""Real surfaces for the solver's tests, read without Blender."""

import os
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from gif import read_gif

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
        path = data_path(relative)
        vertices, faces = (_read_ply if path.suffix == ".ply" else _read_obj)(path)
        return TriangleMesh(vertices, faces, path.stem)

    return load


@pytest.fixture(scope="session")
def silhouette(data_path: Callable[[str], Path]) -> Callable[[str], np.ndarray]:
    """Load a silhouette, as in ``silhouette("car-01.gif")``: (height, width) bool, True inside."""
    return lambda name: read_gif(data_path(f"silhouettes/{name}")) > 127


def _read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read positions and faces; polygons become fans of triangles."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in path.read_text().splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append([float(x) for x in words[:3]])
        elif key == "f":
            first, *rest = (int(word.split("/")[0]) - 1 for word in words)
            faces += [(first, b, c) for b, c in pairwise(rest)]
    return np.array(vertices), np.array(faces)


def _read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read a binary little-endian file of float positions and triangles, nothing else."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    count = {words[1]: int(words[2]) for words in map(str.split, header.decode().splitlines()) if words[0] == "element"}
    vertices = np.frombuffer(body, "<f4", 3 * count["vertex"]).reshape(-1, 3).astype(float)
    triangle = np.dtype([("size", "u1"), ("corners", "<i4", 3)])
    faces = np.frombuffer(body, triangle, count["face"], offset=12 * count["vertex"])
    assert (faces["size"] == 3).all()
    return vertices, faces["corners"]
