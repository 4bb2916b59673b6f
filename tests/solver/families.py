"""Families of surfaces, for collections."""

import numpy as np
from scans import bumps, mirrored, posed

from solver import TriangleMesh
from solver.collection import Specimen


def grown(seed: int, size: int = 700) -> TriangleMesh:
    """One of a family of sheets: the same hills, each bent in a way of its own, in a pose of its own."""
    rng = np.random.default_rng(seed)
    mesh = bumps(size + 20 * (seed % 5), seed=7)
    bend = 0.1 * rng.normal(size=(3, 3))
    x = mesh.vertices + 0.3 * np.sin(mesh.vertices @ bend + bend[0])
    moved = posed(TriangleMesh(x, mesh.faces), seed)
    return mirrored(moved) if seed % 3 == 2 else moved


def specimen(name: str, mesh: TriangleMesh) -> Specimen:
    return Specimen(name, mesh.fingerprint, lambda: (TriangleMesh(mesh.vertices, mesh.faces, name), None))
