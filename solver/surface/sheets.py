"""What keeps a surface from being one sheet: inner walls, edges without length, a second side close below."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .gluing import glue_of
from .mesh import Booleans, Floats, Integers, TriangleMesh, edges_of_sides, twin_sides

WALLS = 0.2
"""Share of the area that walls may have together: more is no wall."""

THIN, OPPOSITE, MOSTLY = 0.05, -0.7, 0.85
"""Distance in roots of the area, cosine between normals, and share of the area of a sheet with thickness: what has a
second side so near, turned away. Faces of a thickness of 0.3 to 2 % of the diagonal have it at 0.96 of their area and
more, hands, feet, ears and heads at 0.36 at most, cortices, in their furrows, at 0.69."""


def is_thick_sheet(mesh: TriangleMesh) -> bool:
    """Return whether a closed surface is a sheet with two sides and a rim, as Solidify makes of an open one."""
    points, normals = mesh.vertices / np.sqrt(mesh.area), mesh.vertex_normals()
    distance, other = KDTree(np.concatenate([points, THIN * normals], axis=1)).query(
        np.concatenate([points, -THIN * normals], axis=1)
    )
    thin = (distance < THIN) & ((normals * normals[other]).sum(axis=1) < OPPOSITE)
    return bool(mesh.vertex_areas[thin].sum() > MOSTLY * mesh.area)


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
