"""Rough triangulations made fair for the computation: noise, and triangles that cut corners, spoil the metric.

What is rough is measured on the mesh itself, free of scale. On a smooth surface normals change as much again from the
next triangle to the one after it as to the next; what they change at once, over no distance, is roughness (the nugget
of a variogram, Matheron 1963). It is taken off by implicit steps of the umbrella operator (Desbrun et al. 1999), as
long as each takes off much of it. Creases and thin features, from which steps take off little, stay.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from .cholesky import factorised
from .descriptors import DIFFUSION_TIMES
from .mesh import Floats, Integers, TriangleMesh

ROUGH = 0.01
"""Roughness up to which a mesh is left alone: the normals of neighbours scatter by a tenth of a radian. Nineteen clean
scans and templates have 0.006 or less, noise of 0.1 % of the diagonal on meshes of 10,000 triangles makes 0.03, of
0.3 % 0.4."""

WORTH = 0.1
"""Share of the roughness at first that a further step has to take off."""

MOSTLY = 0.5
"""Share of the roughness that must be left at most: where more stays it is folds and creases, not noise. Noise and
vertices moved along the surface leave 0.02 to 0.25; ears, hands and heads with lips, 0.6 and more."""

STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Strengths of the implicit step that are tried in turn, in units of the umbrella operator."""


MEDIAN_DEVIATION = 1.4826
"""Standard deviation of a normal distribution by its median absolute value."""


def roughness(mesh: TriangleMesh) -> float:
    """Return the mean square, in radians, of what normals of neighbouring triangles differ by beyond the bending.

    2 g1 - g2, for g1 and g2 the mean squared differences between the normals of triangles with a common side and of
    those with one triangle between them, by area. About 0 where the surface is smooth; may be negative.
    """
    areas = mesh.face_areas
    normals = mesh.face_vectors / np.maximum(2 * areas[:, None], np.finfo(float).tiny)
    beside = mesh.neighbours
    face, side = np.nonzero(beside >= 0)
    next_to = beside[face, side]
    if not len(face):
        return 0.0
    further = beside[next_to]
    kept = (further >= 0) & (further != face[:, None])
    first = np.broadcast_to(face[:, None], kept.shape)[kept]
    return 2 * _differing(normals, areas, face, next_to) - _differing(normals, areas, first, further[kept])


def _differing(normals: Floats, areas: Floats, one: Integers, other: Integers) -> float:
    weight = np.sqrt(areas[one] * areas[other])
    square = ((normals[one] - normals[other]) ** 2).sum(axis=1)
    return float(weight @ square / max(float(weight.sum()), np.finfo(float).tiny))


def faired(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with its roughness taken off; the mesh itself if it is not rough, or not made less so.

    So is one whose edges are longer than the least distance over which curvature is looked at: what its triangles
    differ by is the surface's own bending, as far as they show it. Vertices on the boundary stay where they are.
    """
    if np.median(mesh.edge_lengths) > np.sqrt(2 * DIFFUSION_TIMES[0] * mesh.area):
        return mesh
    at_first = roughness(mesh)
    if at_first <= ROUGH:
        return mesh
    best, left = mesh, at_first
    for strength in STEPS:
        smoother = _smoothed(mesh, strength)
        now = roughness(smoother)
        if left - now < WORTH * at_first:
            break
        best, left = smoother, now
    return best if left <= MOSTLY * at_first else mesh


def noise(exact: Floats, fair: TriangleMesh) -> float:
    """Return the standard deviation along the normals of noise that is independent from vertex to vertex.

    The median difference between neighbours of how far they are from the mean of their own neighbours: what bends the
    surface is nearly the same at both.

    Parameters
    ----------
    exact : (n, 3) float64
        Vertices with the noise.
    fair : TriangleMesh
        The same mesh without it, or nearly so, for its normals.
    """
    i, j = fair.edges.T
    inside = np.ones(len(exact), bool)
    inside[fair.edges[np.bincount(fair.edge_of_side, minlength=len(fair.edges)) == 1]] = False
    degree = np.bincount(fair.edges.ravel(), minlength=len(exact))
    total = np.stack([np.bincount(i, x[j], len(x)) + np.bincount(j, x[i], len(x)) for x in exact.T], axis=1)
    apart = ((exact - total / np.maximum(degree, 1)[:, None]) * fair.vertex_normals()).sum(axis=1)
    both = inside[i] & inside[j]
    if not both.any():
        return 0.0
    i, j = i[both], j[both]
    # of unit noise: each is a neighbour of the other, and they have two more in common
    variance = 2 + 3 / degree[i] + 3 / degree[j] - 4 / (degree[i] * degree[j])
    return float(MEDIAN_DEVIATION * np.median(np.abs(apart[i] - apart[j]) / np.sqrt(variance)))


def _smoothed(mesh: TriangleMesh, strength: float) -> TriangleMesh:
    """Return (I + strength (I - A))^-1 of the positions, A the mean of a vertex's neighbours, the boundary held."""
    i, j = mesh.edges.T
    size = len(mesh.vertices)
    links = csr_array(coo_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(size, size)))
    degree = np.asarray(links.sum(axis=1)).ravel()
    free = degree > 0
    free[mesh.edges[np.bincount(mesh.edge_of_side, minlength=len(mesh.edges)) == 1]] = False
    inside = np.flatnonzero(free)
    if not inside.size:
        return mesh
    # rows times the degree, which makes the system symmetric
    rows = links[inside]
    held = np.where(free[:, None], 0, mesh.vertices)
    right = degree[inside, None] * mesh.vertices[inside] + strength * (rows @ held)
    system = csc_array(diags_array((1 + strength) * degree[inside]) - strength * rows[:, inside])
    vertices = mesh.vertices.copy()
    vertices[inside] = factorised(system)(right)
    return mesh.moved(vertices)
