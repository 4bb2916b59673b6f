"""The cotangent Laplacian and the mass matrix, from side lengths alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from .mesh import Floats, Integers, TriangleMesh


def mollified_lengths(lengths: Floats, relative: float = 1e-6) -> Floats:
    """Return side lengths, (m, 3), grown by one small constant until every triangle has area.

    Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes" (2020), section 4.5: the smallest constant that makes
    each triangle inequality hold with a margin of `relative` times the triangle's longest side; zero for a clean mesh.
    """
    a, b, c = lengths.T
    longest = np.maximum(np.maximum(a, b), c)
    margin = relative * np.maximum(longest, relative * lengths.mean())
    lack = margin + 2 * longest - (a + b + c)
    return lengths + max(0.0, float(lack.max()))


def cotangents(lengths: Floats) -> Floats:
    """Return the cotangent of each corner, (m, 3), of triangles given by the side opposite each corner, (m, 3)."""
    x, y, z = lengths.T
    low, high = np.minimum(x, y), np.maximum(x, y)
    a, b, c = np.maximum(high, z), np.maximum(low, np.minimum(high, z)), np.minimum(low, z)
    # Kahan's arrangement of Heron's formula keeps its digits on needles
    area = 0.25 * np.sqrt(np.maximum((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0))
    area = np.maximum(area, np.maximum(1e-18 * a**2, np.finfo(float).tiny))
    x, y, z = x**2, y**2, z**2
    return np.stack([y + z - x, z + x - y, x + y - z], axis=1) / (4 * area)[:, None]


def cotangent_laplacian(
    faces: Integers, lengths: Floats, vertex_count: int, weights: Floats | None = None
) -> csr_array:
    """Return the positive semidefinite cotangent Laplacian, (n, n): the Dirichlet energy of values u is u^T L u / 2.

    Pinkall and Polthier (1993). Weight of an edge: half the sum of the cotangents opposite it, where each face counts
    as much as its own weight, (m,), says.
    """
    half = 0.5 * cotangents(lengths)
    if weights is not None:
        half *= weights[:, None]
    half = half.ravel()
    i = faces[:, [1, 2, 0]].ravel()
    j = faces[:, [2, 0, 1]].ravel()
    rows = np.concatenate([i, j, i, j])
    columns = np.concatenate([j, i, i, j])
    values = np.concatenate([-half, -half, half, half])
    return csr_array(coo_array((values, (rows, columns)), shape=(vertex_count, vertex_count)))


def laplacian(mesh: TriangleMesh) -> csr_array:
    """Return the cotangent Laplacian of a mesh, (n, n), of mollified side lengths."""
    return cotangent_laplacian(mesh.faces, mollified_lengths(mesh.edge_lengths), len(mesh.vertices))
