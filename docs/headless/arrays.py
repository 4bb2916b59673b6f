"""The correspondence between two surfaces given as arrays, without Blender: `uv run python docs/headless/arrays.py`."""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # where `solver` is
import solver


def scan(points: int, seed: int) -> solver.TriangleMesh:
    """The same hills, scanned anew: other points, other triangles."""
    rng = np.random.default_rng(seed)
    rim = np.linspace(0, 2 * np.pi, points // 20, endpoint=False)
    inside = np.sqrt(rng.uniform(0, 0.96, points)) * np.exp(2j * np.pi * rng.uniform(0, 1, points))
    plane = np.concatenate([np.exp(1j * rim), inside])
    x, y = plane.real, plane.imag
    height = 0.4 * np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.3) ** 2)) - 0.3 * np.exp(-6 * ((x + 0.5) ** 2 + y**2))
    faces = Delaunay(np.stack([x, y], axis=1)).simplices
    return solver.TriangleMesh(np.stack([x, y, height], axis=1), faces)


source, target = scan(2000, seed=1), scan(1500, seed=2)
pose = np.array([[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]])  # turned, and twice the size
posed = solver.TriangleMesh(target.vertices @ pose.T + [3.0, 0.0, 0.0], target.faces)

alignment = solver.align(source, posed)
correspondence = solver.correspond(alignment)
carried = solver.interpolate(correspondence, source.vertices)  # any values at source vertices; here their places

error = np.linalg.norm(carried - target.vertices, axis=1)
print(f"matched {alignment.value:.2f} of at most {alignment.search.upper_bound:.2f}", end=", ")
print("certified" if alignment.certified else "not certified")
print(f"off by {np.median(error):.4f} in the median, on a surface 2 across")
