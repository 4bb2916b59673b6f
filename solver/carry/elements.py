"""Which face, corner or edge of the source each one of the target takes what is not interpolated from."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from ..surface.mesh import Booleans, Floats, Integers
from .correspond import Correspondence
from .interpolate import places
from .seams import middles, nearest_triangles


def source_of_faces(
    correspondence: Correspondence, source_vertices: Floats, target_triangles: Integers, groups: Integers
) -> Integers:
    """Return the source triangle in which the middle of each group of target triangles lies, (g,); -1: none is known.

    The middle is that of the group's largest triangle. Arguments are those of `interpolate_corners`.
    """
    face, place = places(correspondence, source_vertices)
    at = face[target_triangles]
    middle, rank = middles(place[target_triangles], at >= 0, groups)
    result = np.full(len(middle), -1)
    found = np.flatnonzero(rank >= 0)
    corners = source_vertices[correspondence.source_triangles]
    result[found] = nearest_triangles(corners, middle[found], at[rank[found]])[0]
    return result


def source_of_corners(
    correspondence: Correspondence, source_vertices: Floats, target_triangles: Integers, groups: Integers
) -> Integers:
    """Return the source triangle's corner (3 face + 0, 1 or 2) nearest to each corner of target triangles, (3 mt,).

    The corner is looked for from a tenth of the way to the middle of its group, so that it is found in the face
    on the same side of the vertex; -1 where the vertex has no counterpart. Arguments as for `interpolate_corners`.
    """
    face, place = places(correspondence, source_vertices)
    at = face[target_triangles]
    middle, _ = middles(place[target_triangles], at >= 0, groups)
    query = 0.9 * place[target_triangles.ravel()] + 0.1 * np.repeat(middle[groups], 3, axis=0)
    result = np.full(len(query), -1)
    found = np.flatnonzero(at.ravel() >= 0)
    corners = source_vertices[correspondence.source_triangles]
    nearest, weights = nearest_triangles(corners, query[found], at.reshape(-1, 1)[found])
    result[found] = 3 * nearest + weights.argmax(axis=1)
    return result


def source_of_edges(
    correspondence: Correspondence, source_vertices: Floats, source_edges: Integers, target_edges: Integers
) -> Integers:
    """Return the source edge that runs along each target edge, (et,), from edges as pairs of vertices, (es, 2).

    Of the edges nearby it is the one with the least sum of its distance from the target edge's middle and of what the
    target edge's length loses by the angle between them; -1 where an end has no counterpart.
    """
    face, place = places(correspondence, source_vertices)
    result = np.full(len(target_edges), -1)
    found = np.flatnonzero((face[target_edges] >= 0).all(axis=1))
    if len(found) == 0 or len(source_edges) == 0:
        return result
    start, stop = source_vertices[source_edges[:, 0]], source_vertices[source_edges[:, 1]]
    begin, end = place[target_edges[found, 0]], place[target_edges[found, 1]]
    query, run = (begin + end) / 2, end - begin
    length = np.linalg.norm(run, axis=1)
    k = min(16, len(source_edges))
    near = KDTree((start + stop) / 2).query(query, k=k)[1].reshape(len(query), k)
    best_cost = np.full(len(query), np.inf)
    for column in near.T:
        side = stop[column] - start[column]
        square = np.einsum("qd,qd->q", side, side)
        along = np.einsum("qd,qd->q", side, query - start[column])
        along = np.clip(np.divide(along, square, out=np.zeros(len(query)), where=square > 0), 0, 1)
        distance = np.linalg.norm(start[column] + along[:, None] * side - query, axis=1)
        cosine = np.abs(np.einsum("qd,qd->q", side, run))
        cosine = np.divide(cosine, np.sqrt(square) * length, out=np.ones(len(query)), where=square * length > 0)
        cost = distance + length * (1 - cosine)
        better = cost < best_cost
        best_cost[better] = cost[better]
        result[found[better]] = column[better]
    return result


def edges_in_reach(
    correspondence: Correspondence,
    source_vertices: Floats,
    source_edges: Integers,
    marked: Booleans,
    target_edges: Integers,
) -> Booleans:
    """Return which target edges, (et,), `source_of_edges` might bring to one of the marked source edges, (es,).

    An edge of the triangle that a target edge's middle lies in costs at most the longest edge and the target edge's own
    length, so that a marked one further away than that loses.
    """
    face, place = places(correspondence, source_vertices)
    result = np.zeros(len(target_edges), bool)
    found = np.flatnonzero((face[target_edges] >= 0).all(axis=1))
    if len(found) == 0 or not marked.any():
        return result
    begin, end = place[target_edges[found, 0]], place[target_edges[found, 1]]
    start, stop = source_vertices[source_edges[:, 0]], source_vertices[source_edges[:, 1]]
    longest = np.linalg.norm(stop - start, axis=1).max()
    # from the middle of the marked edge, and since the middle of a target edge may lie off the surface
    reach = 1.5 * longest + 1.5 * np.linalg.norm(end - begin, axis=1)
    tree = KDTree(((start + stop) / 2)[marked])
    distance = tree.query((begin + end) / 2, distance_upper_bound=reach.max())[0]
    result[found[distance <= reach]] = True
    return result
