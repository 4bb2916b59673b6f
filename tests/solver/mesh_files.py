"""Reads meshes without Blender: enough of .obj and .ply for the real data."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from solver import TriangleMesh


def read_mesh(path: Path) -> TriangleMesh:
    """Return the mesh of an .obj or .ply file, named after the file."""
    vertices, faces = (_read_ply if path.suffix == ".ply" else _read_obj)(path)
    return TriangleMesh(vertices, faces, path.stem)


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
