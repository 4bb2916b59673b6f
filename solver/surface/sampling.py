"""Points that stand for a surface: extrema of its descriptors first, then the points farthest from all before."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from .mesh import Booleans, Floats, Integers, TriangleMesh

HORIZON = 0.9967  # tanh(3.2)
"""Largest modulus of the points of a search. Near the rim a small change of z moves a point far, so that a proof needs
cells as small as the points' distance from it. Round surfaces lose what is 1/300 of the disc's radius from the rim; on
a band six times as long as wide, half of whose area lies there, searches end 100 times sooner with the same result."""

LARGE = 30_000
"""Vertices from which on distances from a new point are only computed around it."""


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


def farthest_points(
    mesh: TriangleMesh,
    count: int,
    first: Integers,
    allowed: Booleans,
    progress: Callable[[float], None] | None = None,
) -> Integers:
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
    progress : callable, optional
        Called with the share of the points chosen, in [0, 1]; may raise to end it.
    """
    graph = edge_graph(mesh)
    chosen = list(first[:count])
    if not chosen:
        outside = np.flatnonzero(~allowed)
        depth = dijkstra(graph, indices=outside, min_only=True) if len(outside) else np.zeros(len(allowed))
        # from vertices in no face, which is all that a closed surface may leave out, nothing is reached
        chosen = [int(np.argmax(np.where(allowed, np.where(np.isfinite(depth), depth, 0), -1)))]
    distance = dijkstra(graph, indices=chosen, min_only=True)
    reachable = allowed & np.isfinite(distance)
    left = np.where(reachable, distance, -1)
    near = _Surroundings(mesh.vertices, graph) if len(distance) >= LARGE else None
    while len(chosen) < count:
        new = int(np.argmax(left))
        if not reachable[new] or distance[new] <= 0:
            break
        if progress:
            progress(len(chosen) / count)
        chosen.append(new)
        if near is None:
            distance = np.minimum(distance, dijkstra(graph, indices=new, limit=distance[new]))
            left = np.where(reachable, distance, -1)
        else:
            some, apart = near.distances(new, distance)
            distance[some] = np.minimum(distance[some], apart)
            left[some] = np.where(reachable[some], distance[some], -1)
    return np.array(chosen, dtype=np.intp)


class _Surroundings:
    """Finds how far along edges vertices are from a new point: those that may be nearer to it than to all before.

    A way to such a vertex leads through such alone: were one on it nearer to a point before, the last would be too.
    """

    def __init__(self, vertices: Floats, graph: csr_array) -> None:
        self.vertices, self.graph = vertices, graph
        self.tree = KDTree(vertices, compact_nodes=False, balanced_tree=False)
        self.place = np.full(len(vertices), -1)

    def distances(self, new: int, distance: Floats) -> tuple[Integers, Floats]:
        """Return vertices, (k,), and how far they are from vertex `new`, (k,); `distance`, (n,): of all, so far."""
        some = np.array(self.tree.query_ball_point(self.vertices[new], distance[new], return_sorted=False), np.intp)
        apart = np.sqrt(((self.vertices[some] - self.vertices[new]) ** 2).sum(axis=1))
        some = some[(1 - 1e-9) * apart < distance[some]]  # no way along edges is shorter
        graph, place = self.graph, self.place
        place[some] = np.arange(len(some))
        first = graph.indptr[some]
        times = graph.indptr[some + 1] - first
        row = np.repeat(np.arange(len(some)), times)
        entry = np.arange(len(row)) + np.repeat(first - np.cumsum(times) + times, times)
        column = place[graph.indices[entry]]
        inside = column >= 0
        starts = np.concatenate([[0], np.cumsum(np.bincount(row[inside], minlength=len(some)))])
        size = len(some)
        part = csr_array((graph.data[entry[inside]], column[inside], starts), shape=(size, size))
        result = dijkstra(part, indices=int(place[new]), limit=distance[new])
        place[some] = -1
        return some, result


def spread(points: Floats, count: int) -> Integers:
    """Return `count` points, as indices, each the farthest from all before; the first farthest from the middle.

    Straight distances: for points, (n, 3), that only have to be spread evenly, much faster than along a surface.
    """
    x, y, z = columns = np.ascontiguousarray(points.T)

    def squares(a: float, b: float, c: float) -> Floats:
        return (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2

    chosen = [int(np.argmax(squares(*points.mean(axis=0))))]
    square = squares(*columns[:, chosen[0]])
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(square)))
        np.minimum(square, squares(*columns[:, chosen[-1]]), out=square)
    return np.array(chosen, dtype=np.intp)


def thinned(points: Floats, spacing: float) -> Integers:
    """Return points, as sorted indices, no two of which are nearer than `spacing`; all others are within twice that.

    A Poisson-disc subset of points, (n, 3), in time nearly linear in n: thinned to a fraction of the spacing first,
    then to double that, and so on. It depends on distances from the points' middle, not on their pose or order. Of a
    dense area A about 0.53 A / spacing^2 points are left.
    """
    far = np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1)) / spacing
    # as good as random between neighbours, and hardly changed by rounding; what lies first in this order stays
    rank = np.argsort(np.argsort(far * 97 % 1, kind="stable"))
    kept = np.arange(len(points))
    crowded = max(0, int(np.log2(max(len(points), 1)) / 2) - 4)
    for halvings in range(crowded, -1, -1):
        pairs = KDTree(points[kept]).query_pairs(spacing / 2**halvings, output_type="ndarray")
        kept = kept[independent(pairs, rank[kept])]
    return kept


def independent(pairs: Integers, rank: Integers) -> Booleans:
    """Return a maximal set, (n,), that holds one of each pair, (p, 2), at most: what comes first by rank, (n,), stays.

    Luby, "A Simple Parallel Algorithm for the Maximal Independent Set Problem" (1986).
    """
    chosen = np.zeros(len(rank), bool)
    undecided = np.ones(len(rank), bool)
    while len(pairs):
        first = rank[pairs[:, 0]] < rank[pairs[:, 1]]
        later = np.where(first, pairs[:, 1], pairs[:, 0])
        now = undecided.copy()
        now[later] = False
        chosen |= now
        undecided &= ~now
        undecided[pairs[now[pairs[:, 0]], 1]] = False
        undecided[pairs[now[pairs[:, 1]], 0]] = False
        pairs = pairs[undecided[pairs].all(axis=1)]
    return chosen | undecided
