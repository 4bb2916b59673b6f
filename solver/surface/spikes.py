"""Vertices far off the surface: single outliers of a scanner, or hit by accident."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from .mesh import Booleans, Floats, Integers, TriangleMesh, directed_edges

SHARP = 0.3
"""Sum of the angles at a vertex, in radians, below which it is a spike: twenty times as high as it is wide."""

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
        vertices = vertices.copy()
        vertices[sharp] = _between(vertices, mesh.faces, sharp)
        moved = np.concatenate([moved, sharp])
    return (TriangleMesh(vertices, mesh.faces, mesh.name), np.sort(moved)) if moved.size else (mesh, moved)


def _sharp(vertices: Floats, faces: Integers, on_rim: Booleans) -> Integers:
    """Return the vertices that are spikes: inside by their angles, on the rim by the length of their edges too."""
    n, corners = len(vertices), vertices[faces]
    to_next, to_last = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.sqrt((np.cross(to_next, to_last) ** 2).sum(axis=2))
    angles = np.arctan2(sine, (to_next * to_last).sum(axis=2))
    total = np.bincount(faces.ravel(), angles.ravel(), n)
    count = np.bincount(faces.ravel(), minlength=n)
    length = np.sqrt((to_next**2).sum(axis=2))
    nearest = np.full(n, np.inf)
    np.minimum.at(nearest, faces.ravel(), length.ravel())
    np.minimum.at(nearest, faces[:, [1, 2, 0]].ravel(), length.ravel())
    usual = np.median(length)
    times = np.where(on_rim, LONG_ON_RIM, LONG)
    found = np.flatnonzero((count > 0) & (total < np.where(on_rim, SHARP / 6, SHARP)) & (nearest > times * usual))
    return found[nearest[found] > times[found] * _usual_around(vertices, faces, found)]


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


def _between(vertices: Floats, faces: Integers, chosen: Integers) -> Floats:
    """Return the middle of the neighbours of each chosen vertex."""
    start, stop = directed_edges(faces).T
    both = np.concatenate([start, stop]), np.concatenate([stop, start])
    n = len(vertices)
    count = np.bincount(both[0], minlength=n)
    total = np.stack([np.bincount(both[0], column[both[1]], n) for column in vertices.T], axis=1)
    return total[chosen] / count[chosen, None]
