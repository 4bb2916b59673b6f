"""A surface by few of its vertices: nodes spread over it, triangles between them, and how all others follow the nodes.

Everything is found on the surface itself. In the disc a finger has the size of a point, and a triangulation of the
nodes there would hang on rounding errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ..flatten.flatten import Flattening
from ..surface.mesh import Floats, Integers, TriangleMesh
from ..surface.sampling import edge_graph, thinned
from .rotations import smooth_rotations

LEADERS = 4
"""Nodes that a vertex follows, as Sumner et al. (2007) take them."""


@dataclass(frozen=True, eq=False)
class Coarse:
    """A surface by few of its vertices.

    Attributes
    ----------
    nodes : (q,) int
        The vertices.
    faces : (f, 3) int
        Triangles between them, as rows of `nodes`.
    vertices, leaders, weights : (k,) int, (k, l) int, (k, l) float64
        All vertices in use, the nodes that each follows, as rows of `nodes`, and how much: in [0, 1], sum 1.
    """

    nodes: Integers
    faces: Integers
    vertices: Integers
    leaders: Integers
    weights: Floats

    def following(self, rest: Floats, now: Floats, unbent: Floats) -> Floats:
        """Return where all vertices, (n, 3), go when the nodes move from `rest`, (q, 3), to `now`.

        Embedded deformation (Sumner, Schmid and Pauly 2007): the mean of what the surroundings of the nodes it follows
        would do with it. `unbent`, (n, 3), are the vertices before; 0 is returned for those in no face.
        """
        turn = smooth_rotations(TriangleMesh(rest, self.faces), now)[self.leaders]
        from_node = unbent[self.vertices][:, None] - rest[self.leaders]
        moved = now[self.leaders] + np.einsum("kvij,kvj->kvi", turn, from_node)
        result = np.zeros_like(unbent)
        result[self.vertices] = np.einsum("kv,kvd->kd", self.weights, moved)
        return result


def coarse(flattening: Flattening, count: int, order: list[int]) -> Coarse:
    """Return about `count` nodes spread evenly over a surface, the corners of their triangles in the given order.

    The triangles are dual to the regions of vertices nearest to each node, along the edges: one for each face whose
    corners lie in three of them. On a surface with no more vertices than that, all are nodes.
    """
    mesh, used = flattening.mesh, np.flatnonzero(np.isfinite(flattening.disc.real))
    if len(used) <= count:
        place = np.zeros(len(mesh.vertices), np.intp)
        place[used] = np.arange(len(used))
        return Coarse(used, place[mesh.faces][:, order], used, np.arange(len(used))[:, None], np.ones((len(used), 1)))
    inner = np.setdiff1d(used, flattening.boundary, assume_unique=True)
    # as dense along the boundary as inside, for a round surface
    rim = flattening.boundary[:: max(1, round(len(flattening.boundary) / (3.5 * np.sqrt(count))))]
    nodes = np.concatenate([inner[thinned(mesh.vertices[inner], np.sqrt(0.53 * mesh.area / count))], rim])
    region = np.full(len(mesh.vertices), -1)
    place = np.full(len(mesh.vertices), -1)
    place[nodes] = np.arange(len(nodes))
    _, _, nearest = dijkstra(edge_graph(mesh), indices=nodes, min_only=True, return_predecessors=True)
    region[used] = place[nearest[used]]
    faces = _dual(region[mesh.faces])
    held = np.zeros(len(nodes), bool)
    held[faces] = True
    if not held.all():  # a node between two others on a boundary may have no triangle
        renumbered = np.cumsum(held) - 1
        nodes, faces = nodes[held], renumbered[faces]
        place[:] = -1
        place[nodes] = np.arange(len(nodes))
        _, _, nearest = dijkstra(edge_graph(mesh), indices=nodes, min_only=True, return_predecessors=True)
        region[used] = place[nearest[used]]
    leaders, weights = _leaders(mesh.vertices, nodes, faces, used, region[used])
    return Coarse(nodes, faces[:, order], used, leaders, weights)


def _dual(regions: Integers) -> Integers:
    """Return the triangles, (f, 3), between the regions of the corners of faces, (m, 3), each once."""
    apart = (regions != np.roll(regions, 1, axis=1)).all(axis=1)
    faces = regions[apart]
    first = faces.argmin(axis=1)
    turned = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
    faces = np.unique(turned, axis=0)
    # the same three regions may meet twice, seen from both sides where one of them reaches around another
    _, place, times = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return faces[times[place.reshape(-1)] == 1]


def _leaders(
    vertices: Floats, nodes: Integers, faces: Integers, used: Integers, region: Integers
) -> tuple[Integers, Floats]:
    """Return the nodes that vertices follow, (k, l), and how much: the nearest of their region's node and those beside.

    The weight falls with the square of the distance to 0 at the first node that is not followed.
    """
    count = len(nodes)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    beside = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    beside.sum_duplicates()
    most = int(np.diff(beside.indptr).max())
    around = np.full((count, most + 1), -1)
    around[:, 0] = np.arange(count)
    row = np.repeat(np.arange(count), np.diff(beside.indptr))
    around[row, 1 + np.arange(len(row)) - beside.indptr[row]] = beside.indices
    candidates = around[region]
    distance = np.linalg.norm(vertices[nodes[candidates]] - vertices[used][:, None], axis=2)
    distance[candidates < 0] = np.inf
    nearest = np.argsort(distance, axis=1, kind="stable")[:, : LEADERS + 1]
    chosen, distance = np.take_along_axis(candidates, nearest, 1), np.take_along_axis(distance, nearest, 1)
    reach = np.where(np.isfinite(distance), distance, 0).max(axis=1)
    weight = np.maximum(1 - distance / np.maximum(reach, np.finfo(float).tiny)[:, None], 0) ** 2
    weight[:, 0] = np.maximum(weight[:, 0], np.finfo(float).eps)  # one node alone
    chosen = np.where(chosen < 0, chosen[:, :1], chosen)[:, :LEADERS]
    weight = np.where(np.isfinite(distance), weight, 0)[:, :LEADERS]
    return chosen, weight / weight.sum(axis=1, keepdims=True)
