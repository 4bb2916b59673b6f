"""Vertices far off the surface: single outliers of a scanner, or hit by accident."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from .mesh import Booleans, Floats, Integers, TriangleMesh, directed_edges

SHARP = 0.3
"""Sum of the angles at a vertex, in radians, below which it is a spike: twenty times as high as it is wide. On the rim
a sixth of it, as there hands and heads that were cut out of bodies have thin triangles: with the whole of it 1 to 5
vertices of each would be put back."""

LONG, LONG_ON_RIM = 3, 20
"""A spike's edges are longer than so many usual ones, of the mesh and of those around it: where all triangles are thin,
as at the rim of an ear that was cut out of a head, none is a spike."""

ROUNDS = 3
"""A spike beside another shows once the first is gone."""


def without_spikes(mesh: TriangleMesh) -> tuple[TriangleMesh, Integers]:
    """Return the mesh with each spike put back between its neighbours, and which vertices these were."""
    vertices, moved = mesh.vertices, np.empty(0, np.intp)
    on_rim = np.zeros(len(vertices), bool)
    on_rim[directed_edges(mesh.faces)[mesh.twins < 0]] = True
    for _ in range(ROUNDS):
        sharp = np.setdiff1d(_sharp(vertices, mesh.faces, on_rim), moved)
        if not sharp.size:
            break
        moved = np.union1d(moved, sharp)
        vertices = _without(vertices, mesh.faces, moved)
    return (TriangleMesh(vertices, mesh.faces, mesh.name), moved) if moved.size else (mesh, moved)


def _sharp(vertices: Floats, faces: Integers, on_rim: Booleans) -> Integers:
    """Return the vertices that are spikes: by the length of their edges, and by their angles.

    Of two spikes beside each other neither counts for the angle of the other.
    """
    n, corners = len(vertices), vertices[faces]
    to_next, to_last = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    length = np.sqrt((to_next**2).sum(axis=2))
    nearest = np.full(n, np.inf)
    np.minimum.at(nearest, faces.ravel(), length.ravel())
    np.minimum.at(nearest, faces[:, [1, 2, 0]].ravel(), length.ravel())
    times = np.where(on_rim, LONG_ON_RIM, LONG)
    far = np.flatnonzero(np.isfinite(nearest) & (nearest > times * np.median(length)))
    far = far[nearest[far] > times[far] * _usual_around(vertices, faces, far)]
    is_far = np.zeros(n, bool)
    is_far[far] = True
    sine = np.sqrt((np.cross(to_next, to_last) ** 2).sum(axis=2))
    angles = np.arctan2(sine, (to_next * to_last).sum(axis=2))
    beside = is_far[np.roll(faces, 1, axis=1)] | is_far[np.roll(faces, -1, axis=1)]
    total = np.bincount(faces.ravel(), np.where(beside, 0, angles).ravel(), n)
    return far[total[far] < np.where(on_rim[far], SHARP / 6, SHARP)]


def _usual_around(vertices: Floats, faces: Integers, chosen: Integers) -> Floats:
    """Return the median length, (k,), of the edges at the neighbours of each chosen vertex that are not its own."""
    if not chosen.size:
        return np.empty(0)
    start, stop = directed_edges(faces).T
    both = np.concatenate([start, stop]), np.concatenate([stop, start])
    n = len(vertices)
    links = csr_array((np.ones(len(both[0]), np.int8), both), shape=(n, n))
    links.sum_duplicates()
    result = np.empty(len(chosen))
    for k, vertex in enumerate(chosen.tolist()):
        near = links.indices[links.indptr[vertex] : links.indptr[vertex + 1]]
        rows = links[near].tocoo()
        others = rows.col != vertex
        apart = vertices[near[rows.row[others]]] - vertices[rows.col[others]]
        result[k] = np.median(np.linalg.norm(apart, axis=1)) if len(apart) else 0.0
    return result


def _without(vertices: Floats, faces: Integers, chosen: Integers) -> Floats:
    """Return the vertices with the chosen ones in the middle of their neighbours that are not chosen.

    Those that have none come after these, one ring after the other.
    """
    start, stop = directed_edges(faces).T
    one, other = np.concatenate([start, stop]), np.concatenate([stop, start])
    n, vertices = len(vertices), vertices.copy()
    placed = np.ones(n, bool)
    placed[chosen] = False
    while True:
        known = placed[other] & ~placed[one]
        count = np.bincount(one[known], minlength=n)
        ring = np.flatnonzero(count)
        if not ring.size:
            return vertices
        total = np.stack([np.bincount(one[known], column[other[known]], n) for column in vertices.T], axis=1)
        vertices[ring] = total[ring] / count[ring, None]
        placed[ring] = True
