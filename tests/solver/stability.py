"""Whether a map hangs on the last digits of the coordinates."""

import numpy as np

from solver import AlignSettings, TriangleMesh, align, correspond
from solver.surface.barycentric import interpolated

SHIFT = 1e-9
"""Standard deviation of the noise, as a share of the diagonal."""

SAME = 1e-3
"""Share of the source's diagonal up to which two maps are the same."""


def shifted(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Return the mesh with noise that nothing it shows depends on."""
    noise = np.random.default_rng(seed).normal(scale=SHIFT * mesh.diagonal, size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + noise, mesh.faces, mesh.name)


def places(source: TriangleMesh, target: TriangleMesh, settings: AlignSettings | None = None) -> np.ndarray:
    """Return where each target vertex goes on the source, (n, 3)."""
    found = correspond(align(source, target, settings))
    return interpolated(source.vertices, source.faces[found.face], found.barycentric)


def apart(source: TriangleMesh, target: TriangleMesh, settings: AlignSettings | None = None) -> np.ndarray:
    """Return by how much the map moves when the vertices of both do, (n,), as shares of the source's diagonal."""
    before = places(source, target, settings)
    return np.linalg.norm(places(shifted(source, 0), shifted(target, 1), settings) - before, axis=1) / source.diagonal
