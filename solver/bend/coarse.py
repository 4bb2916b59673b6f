"""A surface by few of its vertices: nodes spread over it, triangles between them, and how all others follow the nodes.

The triangles are Delaunay in the disc, unless it is so crowded that they would hang on rounding errors: there a finger
has the size of a point. Then they are found on the surface itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from ..flatten.domain import Domain
from ..flatten.sphere import Flat
from ..surface.barycentric import weighted
from ..surface.mesh import Floats, Integers, Places, TriangleMesh
from ..surface.nearest import nearest_in_triangle
from ..surface.sampling import edge_graph, thinned
from .rotations import smooth_rotations

CROWDED = 1e-4
"""Distance of nodes in the disc below which it is crowded: Delaunay's test compares squares of distances, here 1e-8 and
less, of points at a distance of 1 from the origin, which doubles hold to 1e-16."""


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

    def turned(self) -> Coarse:
        """Return the same with its triangles the other way round."""
        return replace(self, faces=self.faces[:, [0, 2, 1]])

    def following(self, rest: Floats, now: Floats, unbent: Floats) -> Floats:
        """Return where all vertices, (n, 3), go when the nodes move from `rest`, (q, 3), to `now`.

        Embedded deformation (Sumner, Schmid and Pauly 2007): the mean of what the surroundings of the nodes it follows
        would do with it. `unbent`, (n, 3), are the vertices before; 0 is returned for those in no face.
        """
        turn = smooth_rotations(TriangleMesh(rest, self.faces), now)[self.leaders]
        from_node = unbent[self.vertices][:, None] - rest[self.leaders]
        moved = now[self.leaders] + np.einsum("kvij,kvj->kvi", turn, from_node)
        result = np.zeros_like(unbent)
        result[self.vertices] = weighted(moved, self.weights)
        return result


def coarse(flattening: Flat, count: int, order: list[int]) -> Coarse:
    """Return about `count` nodes spread evenly over a surface, the corners of their triangles in the given order.

    On a surface with no more vertices than that, all are nodes. Where the disc is crowded the triangles are dual to the
    regions of vertices nearest to each node, along the edges: one for each face whose corners lie in three of them.
    """
    mesh, used = flattening.mesh, np.flatnonzero(flattening.mesh.used)
    if len(used) <= count:
        place = np.zeros(len(mesh.vertices), np.intp)
        place[used] = np.arange(len(used))
        return Coarse(used, place[mesh.faces][:, order], used, np.arange(len(used))[:, None], np.ones((len(used), 1)))
    inner = np.setdiff1d(used, flattening.boundary, assume_unique=True)
    # as dense along the boundary as inside, for a round surface
    rim = flattening.boundary[:: max(1, round(len(flattening.boundary) / (3.5 * np.sqrt(count))))]
    nodes = np.concatenate([inner[thinned(mesh.vertices[inner], np.sqrt(0.53 * mesh.area / count))], rim])
    domain, places = flattening.domain, flattening.places
    spots = domain.coordinates(places[nodes])
    apart = KDTree(spots).query(spots, k=2)[0][:, 1].min()
    if apart > CROWDED:
        nodes, faces = _delaunay(domain, places, nodes)
        leaders, weights = domain.triangulated(places[nodes], faces).locate(places[used])
        return Coarse(nodes, faces[:, order], used, faces[leaders], weights)
    region = _regions(mesh, nodes)
    faces = _dual(region[mesh.faces])
    held = np.unique(faces)
    if len(held) < len(nodes):  # a node between two others on a boundary may have no triangle
        renumbered = np.full(len(nodes), -1)
        renumbered[held] = np.arange(len(held))
        nodes, faces = nodes[held], renumbered[faces]
        region = _regions(mesh, nodes)
    leaders, weights = _leaders(mesh.vertices, nodes, faces, used, region[used])
    return Coarse(nodes, faces[:, order], used, leaders, weights)


def _delaunay(domain: Domain, places: Places, nodes: Integers) -> tuple[Integers, Integers]:
    """Return the nodes and their Delaunay triangles in the domain, (f, 3), without slivers."""
    faces = domain.delaunay(places[nodes])
    held, place = np.unique(faces, return_inverse=True)
    return nodes[held], place.reshape(-1, 3)


def _regions(mesh: TriangleMesh, nodes: Integers) -> Integers:
    """Return the row in `nodes` of the one nearest to each vertex, (n,), along edges; -1 at vertices in no face."""
    _, _, nearest = dijkstra(edge_graph(mesh), indices=nodes, min_only=True, return_predecessors=True)
    place = np.full(len(mesh.vertices), -1)
    place[nodes] = np.arange(len(nodes))
    return np.where(nearest >= 0, place[np.maximum(nearest, 0)], -1)  # -9999 where no node leads


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
    """Return the nodes that vertices follow, (k, 3), and how much: barycentric coordinates of the nearest point.

    Of the triangles around the node of their region, so that nothing across a gap is followed.
    """
    count = len(nodes)
    corner = np.argsort(faces.ravel(), kind="stable")
    first = np.searchsorted(faces.ravel()[corner], np.arange(count + 1))
    leaders, weights = np.zeros((len(used), 3), np.intp), np.zeros((len(used), 3))
    least = np.full(len(used), np.inf)
    for k in range(int(np.diff(first).max())):
        row = np.flatnonzero(first[region] + k < first[region + 1])
        face = corner[first[region[row]] + k] // 3
        corners = vertices[nodes[faces[face]]]
        barycentric = nearest_in_triangle(vertices[used[row]], corners)
        apart = np.linalg.norm(weighted(corners, barycentric) - vertices[used[row]], axis=1)
        nearer = apart < least[row]
        row = row[nearer]
        leaders[row], weights[row], least[row] = faces[face[nearer]], barycentric[nearer], apart[nearer]
    return leaders, weights
