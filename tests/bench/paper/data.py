"""Where the real shapes are, and how their files are read."""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np

from solver import TriangleMesh

DATA = Path(os.environ.get("MOBIUS_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))


def absent(relative: str) -> str:
    """Return why an experiment on a file of the real data cannot run; empty if it can."""
    if (DATA / relative).exists():
        return ""
    return f"'{relative}' is not in the folder of real data: set MOBIUS_DATA to the folder that holds it"


def read_obj(relative: str) -> TriangleMesh:
    """Read positions and faces of an .obj file of the real data; polygons become fans of triangles."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in (DATA / relative).read_text().splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append([float(x) for x in words[:3]])
        elif key == "f":
            first, *rest = (int(word.split("/")[0]) - 1 for word in words)
            faces += [(first, b, c) for b, c in pairwise(rest)]
    return TriangleMesh(np.array(vertices), np.array(faces), Path(relative).stem)
