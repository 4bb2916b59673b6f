"""Points that stand for a surface: extrema of its descriptors first, then the points farthest from all before."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from .mesh import Booleans, Floats, Integers, TriangleMesh


def edge_graph(mesh: TriangleMesh) -> csr_array:
    """Return the symmetric sparse matrix of edge lengths, (n, n)."""
    n = len(mesh.vertices)
    i, j = mesh.edges.T
    length = np.maximum(np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1), np.finfo(float).tiny)
    half = coo_array((length, (i, j)), shape=(n, n))
    return csr_array(half + half.T)


def extrema(mesh: TriangleMesh, values: Floats, allowed: Booleans) -> Integers:
    """Return the allowed vertices where `values`, (n,), exceeds or undercuts all neighbours, most pronounced first."""
    i, j = mesh.edges.T
    highest, lowest = np.full(len(values), -np.inf), np.full(len(values), np.inf)
    for a, b in ((i, j), (j, i)):
        np.maximum.at(highest, a, values[b])
        np.minimum.at(lowest, a, values[b])
    found = np.flatnonzero(allowed & ((values > highest) | (values < lowest)))
    return found[np.argsort(-np.abs(values[found]), kind="stable")]


def farthest_points(mesh: TriangleMesh, count: int, first: Integers, allowed: Booleans) -> Integers:
    """Return up to `count` vertices: those in `first`, then again and again the allowed one farthest from all before.

    Distances run along edges (Dijkstra), so that a bent surface gives the same points.

    Parameters
    ----------
    mesh : TriangleMesh
    count : int
        At least 1; fewer are returned where no allowed vertex is left.
    first : (k,) int
        Where to begin; if empty, at the allowed vertex farthest from those not allowed.
    allowed : (n,) bool
        Vertices that may be chosen.
    """
    graph = edge_graph(mesh)
    chosen = list(first[:count])
    if not chosen:
        outside = np.flatnonzero(~allowed)
        depth = dijkstra(graph, indices=outside, min_only=True) if len(outside) else np.zeros(len(allowed))
        chosen = [int(np.argmax(np.where(allowed & np.isfinite(depth), depth, -1)))]
    distance = dijkstra(graph, indices=chosen, min_only=True)
    reachable = allowed & np.isfinite(distance)
    while len(chosen) < count:
        new = int(np.argmax(np.where(reachable, distance, -1)))
        if not reachable[new] or distance[new] <= 0:
            break
        chosen.append(new)
        distance = np.minimum(distance, dijkstra(graph, indices=new, limit=distance[new]))
    return np.array(chosen, dtype=np.intp)


def spread(points: Floats, count: int) -> Integers:
    """Return `count` points, as indices, each the farthest from all before; the first farthest from the middle.

    Straight distances: for points, (n, 3), that only have to be spread evenly, much faster than along a surface.
    """
    square = ((points - points.mean(axis=0)) ** 2).sum(axis=1)
    chosen = [int(np.argmax(square))]
    square = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(square)))
        np.minimum(square, ((points - points[chosen[-1]]) ** 2).sum(axis=1), out=square)
    return np.array(chosen, dtype=np.intp)
