"""Handles of a surface, and the shortest loops to cut them along.

Erickson and Whittlesey, "Greedy Optimal Homotopy and Homology Generators" (2005): with a tree of shortest paths from a
vertex and a spanning tree of the faces that crosses none of its edges, 2 g edges are left on a surface of genus g. Each
closes a loop that does not bound, and those are the shortest through that vertex. The shortest of all crosses one of
them, so that vertices on these are tried next.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree

from .gluing import Glue, vertices_of_glue
from .mesh import Floats, Integers, TriangleMesh, directed_edges

LARGEST_LOOP = 0.5
"""Length of a loop, in roots of the area, up to which a handle is cut along it."""

MOST = 20
"""Handles up to which a surface is cut open; more are a fault of how it was made."""

ROUNDS = 4
"""From one loop to a shorter one."""

FEWEST_ROOTS, MOST_ROOTS, WORK = 4, 24, 400_000
"""Vertices through which loops are looked for in a round, fewer on large surfaces."""


def cut_handles(mesh: TriangleMesh, glue: Glue, count: int) -> tuple[list[float], Integers, Integers, Integers]:
    """Cut an oriented manifold surface along a loop around each of its handles, which leaves two openings of each.

    Returns
    -------
    lengths : list of float
        Of the loops; fewer than `count` where a loop is too long.
    faces, vertex_of, origin : (m, 3) int, (n,) int, (n_new,) int
        As `vertices_of_glue` gives them.
    """
    lengths: list[float] = []
    n = len(mesh.vertices)
    faces, vertex_of, origin = mesh.faces, np.where(mesh.used, np.arange(n), -1), np.arange(n)
    limit = LARGEST_LOOP * np.sqrt(mesh.area)
    while len(lengths) < count:
        loop, length = _shortest_loop(mesh.vertices[origin], faces, glue)
        if len(loop) < 2 or length > limit:
            break
        glue = glue.without(_sides_along(faces, glue, loop))
        faces, vertex_of, origin = vertices_of_glue(mesh.faces, glue, n)
        lengths.append(length)
    return lengths, faces, vertex_of, origin


def _sides_along(faces: Integers, glue: Glue, loop: Integers) -> Integers:
    """Return the glued sides between successive vertices of a loop, (k,)."""
    n = int(faces.max()) + 1
    start, stop = directed_edges(faces)[glue.left].T
    ahead = np.roll(loop, -1)
    wanted = np.minimum(loop, ahead) * n + np.maximum(loop, ahead)
    return glue.left[np.isin(np.minimum(start, stop) * n + np.maximum(start, stop), wanted)]


def _shortest_loop(positions: Floats, faces: Integers, glue: Glue) -> tuple[Integers, float]:
    """Return a loop, as vertices in order, that does not bound, about the shortest, and its length."""
    graph = _Graph(positions, faces, glue)
    loops = graph.loops_through(int(faces[0, 0]))
    roots = max(FEWEST_ROOTS, min(MOST_ROOTS, WORK // len(positions)))
    best, length = loops[0] if loops else (np.empty(0, np.intp), np.inf)
    for _ in range(ROUNDS):
        on_loops = np.concatenate([loop for loop, _ in loops]) if loops else best
        some = on_loops[np.unique(np.linspace(0, len(on_loops) - 1, roots).astype(int))]
        again = [found for root in some.tolist() if (found := graph.loops_through(root))]
        if not again:
            break
        loops = min(again, key=lambda found: found[0][1])
        if loops[0][1] >= length * (1 - 1e-9):
            break
        best, length = loops[0]
    return best, float(length)


class _Graph:
    """Vertices joined by edges, and faces and openings joined across them."""

    def __init__(self, positions: Floats, faces: Integers, glue: Glue) -> None:
        n, m = len(positions), len(faces)
        rim = glue.single_sides(m)
        sides = np.concatenate([glue.left, rim])
        self.start, self.stop = directed_edges(faces)[sides].T
        self.length = np.sqrt(((positions[self.start] - positions[self.stop]) ** 2).sum(axis=1))
        # a boundary loop is one more face
        start, stop = directed_edges(faces)[rim].T
        around = coo_array((np.ones(len(rim), np.int8), (start, stop)), shape=(n, n))
        opening = connected_components(around, directed=False)[1][start]
        self.one = sides // 3
        self.other = np.concatenate([glue.right // 3, m + np.unique(opening, return_inverse=True)[1].reshape(-1)])
        self.count = n
        both = np.concatenate([self.start, self.stop]), np.concatenate([self.stop, self.start])
        weight = np.maximum(np.concatenate([self.length, self.length]), np.finfo(float).tiny)
        self.edges = csr_array(coo_array((weight, both), shape=(n, n)))

    def loops_through(self, root: int) -> list[tuple[Integers, float]]:
        """Return loops that do not bound, shortest first, from the shortest paths from a vertex."""
        distance, before = dijkstra(self.edges, directed=False, indices=root, return_predecessors=True)
        start, stop = self.start, self.stop
        in_tree = (before[start] == stop) | (before[stop] == start)
        around = distance[start] + distance[stop] + self.length
        free = np.flatnonzero(~in_tree & np.isfinite(around))
        # the tree across the longest loops; of parallel edges the longest
        free = free[np.argsort(-around[free], kind="stable")]
        low, high = np.minimum(self.one, self.other)[free], np.maximum(self.one, self.other)[free]
        nodes = int(high.max(initial=0)) + 1
        _, first = np.unique(low * nodes + high, return_index=True)
        first = first[low[first] != high[first]]
        rank = np.arange(len(free)) + 1.0
        ends = low[first].astype(np.int32), high[first].astype(np.int32)  # what scipy's trees take
        tree = minimum_spanning_tree(csr_array((rank[first], ends), shape=(nodes, nodes)))
        left = np.ones(len(free), bool)
        left[tree.data.astype(np.intp) - 1] = False
        found = [self._loop(int(edge), before) for edge in free[left][::-1]]
        return sorted(found, key=lambda x: x[1])

    def _loop(self, edge: int, before: Integers) -> tuple[Integers, float]:
        """Return the loop that an edge closes over the tree of paths, without the way there, and its length."""
        ways = []
        for end in (int(self.start[edge]), int(self.stop[edge])):
            way = [end]
            while before[way[-1]] >= 0:
                way.append(int(before[way[-1]]))
            ways.append(way)
        one, other = ways
        while len(one) > 1 and len(other) > 1 and one[-2] == other[-2]:
            one.pop()
            other.pop()
        loop = np.array(one[:-1] + other[::-1], np.intp)
        lengths = [self.edges[a, b] for a, b in pairwise(loop.tolist())]
        return loop, float(sum(lengths) + self.length[edge])
