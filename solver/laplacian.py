"""The cotangent Laplacian and the mass matrix, from side lengths alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array, dia_array

from .mesh import Floats, Integers, TriangleMesh


def mollified_lengths(lengths: Floats, relative: float = 1e-6) -> Floats:
    """Return side lengths, (m, 3), grown by one small constant until every triangle has area.

    Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes" (2020), section 4.5: the smallest constant that makes
    each triangle inequality hold with a margin of `relative` times the triangle's longest side; zero for a clean mesh.
    """
    margin = relative * np.maximum(lengths.max(axis=1), relative * lengths.mean())
    lack = margin + 2 * lengths.max(axis=1) - lengths.sum(axis=1)
    return lengths + max(0.0, float(lack.max()))


def cotangents(lengths: Floats) -> Floats:
    """Return the cotangent of each corner, (m, 3), of triangles given by the side opposite each corner, (m, 3)."""
    a, b, c = np.sort(lengths, axis=1)[:, ::-1].T
    # Kahan's arrangement of Heron's formula keeps its digits on needles
    area = 0.25 * np.sqrt(np.maximum((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0))
    square = lengths**2
    return (square.sum(axis=1, keepdims=True) - 2 * square) / (4 * np.maximum(area, np.finfo(float).tiny)[:, None])


def cotangent_laplacian(faces: Integers, lengths: Floats, vertex_count: int) -> csr_array:
    """Return the positive semidefinite cotangent Laplacian, (n, n): the Dirichlet energy of values u is u^T L u / 2.

    Pinkall and Polthier (1993). Weight of an edge: half the sum of the cotangents opposite it.
    """
    half = 0.5 * cotangents(lengths).ravel()
    i = faces[:, [1, 2, 0]].ravel()
    j = faces[:, [2, 0, 1]].ravel()
    rows = np.concatenate([i, j, i, j])
    columns = np.concatenate([j, i, i, j])
    values = np.concatenate([-half, -half, half, half])
    return csr_array(coo_array((values, (rows, columns)), shape=(vertex_count, vertex_count)))


def laplacian(mesh: TriangleMesh) -> csr_array:
    """Return the cotangent Laplacian of a mesh, (n, n), of mollified side lengths."""
    return cotangent_laplacian(mesh.faces, mollified_lengths(mesh.edge_lengths), len(mesh.vertices))


def mass(mesh: TriangleMesh) -> dia_array:
    """Return the lumped mass matrix, (n, n), of barycentric areas, in squared length units."""
    n = len(mesh.vertices)
    return dia_array((mesh.vertex_areas[None], [0]), shape=(n, n))
