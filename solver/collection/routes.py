"""How specimens are reached from one of them: along a spanning tree, or directly, and round what is suspect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree

from ..surface.mesh import Floats
from .cycles import Edge

LEAST = 1e-6
"""What a pair costs at least: 0 would mean that there is none."""

AVOIDED = 1e3
"""What a suspect pair costs beyond the others, so that it is gone along only where nothing else leads."""


def medoid(count: int, edges: Sequence[Edge], costs: Floats) -> int:
    """Return the specimen whose pairs cost least on average; of those with fewest pairs missing."""
    total, number = np.zeros(count), np.zeros(count)
    for edge, cost in zip(edges, costs, strict=True):
        total[list(edge)] += cost
        number[list(edge)] += 1
    mean = np.divide(total, number, out=np.full(count, np.inf), where=number > 0)
    return int(np.lexsort((mean, -number))[0])


def tree_routes(
    count: int, edges: Sequence[Edge], costs: Floats, avoided: Sequence[bool], root: int
) -> dict[int, list[int]]:
    """Return the path from the root to each specimen that can be reached, along the minimum spanning tree."""
    return _paths(minimum_spanning_tree(_graph(count, edges, np.where(avoided, costs + AVOIDED, costs))), root)


def star_routes(
    count: int, edges: Sequence[Edge], costs: Floats, avoided: Sequence[bool], root: int
) -> dict[int, list[int]]:
    """Return the path from the root to each specimen: its own pair, but where this is to be avoided the cheapest."""
    paths = _paths(_graph(count, edges, np.where(avoided, costs + AVOIDED, costs)), root)
    for (a, b), bad in zip(edges, avoided, strict=True):
        if root in (a, b) and not bad:
            other = b if a == root else a
            paths[other] = [root, other]
    return paths


def _graph(count: int, edges: Sequence[Edge], costs: Floats) -> coo_array:
    pairs = np.array(edges, np.int32).reshape(-1, 2)
    return coo_array((np.maximum(costs, LEAST), (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _paths(graph: coo_array, root: int) -> dict[int, list[int]]:
    lengths, before = dijkstra(graph, directed=False, indices=root, return_predecessors=True)
    found: dict[int, list[int]] = {}
    for end in np.flatnonzero(np.isfinite(lengths)).tolist():
        path = [end]
        while path[-1] != root:
            path.append(int(before[path[-1]]))
        found[end] = path[::-1]
    return found
