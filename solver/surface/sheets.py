"""Faces that keep a surface from being one: inner walls, and edges without length."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .gluing import glue_of
from .mesh import Booleans, Floats, Integers, edges_of_sides, twin_sides

WALLS = 0.2
"""Share of the area that walls may have together: more is no wall."""


def inner_walls(faces: Integers, areas: Floats, vertex_count: int) -> Booleans:
    """Return which faces, (m,), to leave out so that no edge has three or more; none if that takes too many.

    Cut along such edges the surface falls into sheets. The smallest at such an edge goes first.
    """
    edge = edges_of_sides(faces, vertex_count)[1]
    out = np.zeros(len(faces), bool)
    crowded = np.flatnonzero(np.bincount(edge)[edge] > 2)
    if not crowded.size:
        return out
    sheet = glue_of(faces, twin_sides(edge)).parts(len(faces))
    area = np.bincount(sheet, areas)
    gone = np.zeros(len(area), bool)
    count = np.bincount(edge[crowded], minlength=int(edge.max()) + 1)
    of_sheet = sheet[crowded // 3]
    for candidate in sorted(set(of_sheet.tolist()), key=lambda k: (area[k], k)):
        own = edge[crowded[of_sheet == candidate]]
        if (count[own] <= 2).all():
            continue
        gone[candidate] = True
        count -= np.bincount(own, minlength=len(count))
        if area[gone].sum() > WALLS * areas.sum():
            return out
        if (count <= 2).all():
            return gone[sheet]
    return out


def drawn_together(positions: Floats, faces: Integers, shortest: float) -> Integers:
    """Return the vertex that each vertex, (n,), becomes when edges of `shortest` or less are drawn together."""
    low, high = edges_of_sides(faces, len(positions))[0].T
    short = np.sqrt(((positions[low] - positions[high]) ** 2).sum(axis=1)) <= shortest
    n = len(positions)
    if not short.any():
        return np.arange(n)
    links = low[short], high[short]
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(n, n))
    label = connected_components(graph, directed=False)[1]
    first = np.full(int(label.max()) + 1, n)
    np.minimum.at(first, label, np.arange(n))
    return first[label]
