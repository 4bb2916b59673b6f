"""Values carried from the source to the target through a correspondence."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .correspond import Correspondence
from .mesh import Floats, Integers, directed_edges


def interpolate(correspondence: Correspondence, values: npt.ArrayLike) -> Floats:
    """Return values at target vertices, (n_target, ...), linear between values at source vertices, (n_source, ...).

    0 at target vertices without a counterpart.

    Raises
    ------
    ValueError
        The number of values is not the number of source vertices.
    """
    given = np.asarray(values, dtype=np.float64)
    if len(given) != correspondence.source_size:
        raise ValueError(f"{len(given)} values do not fit a source of {correspondence.source_size} vertices")
    flat = given.reshape(len(given), -1)
    return (correspondence.matrix() @ flat).reshape((len(correspondence.face), *given.shape[1:]))


def value_islands(triangles: Integers, corner_values: Floats) -> Integers:
    """Label triangles, (m,), so that those agree whose values run on continuously across their common sides.

    Parameters
    ----------
    triangles : (m, 3) int
    corner_values : (3 m, d) float64
        A value per corner of each triangle, as of a UV map.
    """
    sides = directed_edges(triangles)
    start = corner_values.reshape(len(triangles), 3, -1)[:, [1, 2, 0]].reshape(len(sides), -1)
    stop = corner_values.reshape(len(triangles), 3, -1)[:, [2, 0, 1]].reshape(len(sides), -1)
    turned = sides[:, 0] > sides[:, 1]
    low, high = np.where(turned[:, None], stop, start), np.where(turned[:, None], start, stop)
    key = sides.min(axis=1) * (triangles.max() + 1) + sides.max(axis=1)
    order = np.argsort(key, kind="stable")
    left, right = order[:-1], order[1:]
    joined = (key[left] == key[right]) & (low[left] == low[right]).all(axis=1) & (high[left] == high[right]).all(axis=1)
    links = np.stack([left[joined], right[joined]]) // 3
    graph = coo_array((np.ones(links.shape[1], np.int8), (links[0], links[1])), shape=(len(triangles),) * 2)
    return connected_components(graph, directed=False)[1].astype(np.intp)


def interpolate_corners(
    correspondence: Correspondence,
    source_vertices: Floats,
    source_corner_values: npt.ArrayLike,
    target_triangles: Integers,
) -> Floats:
    """Return values at the corners of target triangles, (3 mt, d), from values at the corners of source triangles.

    Each target triangle takes its values from one island of the source (`value_islands`): the one that most of its
    corners lie in. A corner that lies beyond the island's border takes the nearest value of the island, so that no
    value is a mean of two islands.

    Parameters
    ----------
    correspondence : Correspondence
    source_vertices : (n_source, 3) float64
        Positions, to find what is nearest.
    source_corner_values : (3 ms, d) float
        In the order of `correspondence.source_triangles`.
    target_triangles : (mt, 3) int
    """
    triangles = correspondence.source_triangles
    given = np.asarray(source_corner_values, dtype=np.float64).reshape(3 * len(triangles), -1)
    island = value_islands(triangles, given)
    corner_vertex = target_triangles.ravel()
    face, barycentric = correspondence.face[corner_vertex], correspondence.barycentric[corner_vertex].copy()
    known = face >= 0
    own = np.where(known, island[face], -1).reshape(-1, 3)
    # the island of two corners, else of the first
    wanted = np.where(own[:, 1] == own[:, 2], own[:, 1], own[:, 0])
    wanted = np.where(wanted < 0, own.max(axis=1), wanted)
    wanted = np.repeat(wanted, 3)
    astray = np.flatnonzero((wanted >= 0) & known & (island[face] != wanted))
    if len(astray):
        place = np.einsum("qk,qkd->qd", barycentric[astray], source_vertices[triangles[face[astray]]])
        for label in np.unique(wanted[astray]):
            rows = np.flatnonzero(wanted[astray] == label)
            members = np.flatnonzero(island == label)
            corners = triangles[members].ravel()
            nearest = KDTree(source_vertices[corners]).query(place[rows])[1]
            face[astray[rows]] = members[nearest // 3]
            barycentric[astray[rows]] = np.eye(3)[nearest % 3]
    values = np.einsum("qk,qkd->qd", barycentric, given.reshape(len(triangles), 3, -1)[face])
    values[~known] = 0
    return values
