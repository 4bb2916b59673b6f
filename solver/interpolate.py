"""Values carried from the source to the target through a correspondence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .correspond import Correspondence
from .mesh import Booleans, Floats, Integers, TriangleMesh, directed_edges, edges_of_sides, twin_sides
from .surface_points import nearest_in_triangle

_REACH = 4.0
"""How much faster than at the two ends a value may change between two points of one side of a seam."""

_PIECE = 2048
"""Of so many matrices everything fits in the processor's cache."""


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
    joints = Joints.of(triangles)
    return Charts.of(joints, corner_values, joints.equal(corner_values)).island


@dataclass(frozen=True, eq=False)
class Joints:
    """Corners that meet at the ends of the sides that two triangles share.

    Attributes
    ----------
    triangles : (m, 3) int
    side, other : (s,) int
        The two sides, as `twin_sides` numbers them.
    ends, ends_beyond : (s, 2) int
        The corners at both ends of each, and those of the triangle beyond it at the same vertices.
    """

    triangles: Integers
    side: Integers
    other: Integers
    ends: Integers
    ends_beyond: Integers

    @staticmethod
    def of(triangles: Integers) -> Joints:
        """Find them."""
        vertex = triangles.ravel()
        twin = twin_sides(edges_of_sides(triangles, int(vertex.max()) + 1)[1])
        side = np.flatnonzero(twin > np.arange(len(twin)))
        other = twin[side]
        corners = np.arange(len(vertex)).reshape(-1, 3)
        ends, ends_beyond = directed_edges(corners)[side], directed_edges(corners)[other]
        crossed = vertex[ends[:, 0]] != vertex[ends_beyond[:, 0]]
        ends_beyond[crossed] = ends_beyond[crossed, ::-1]
        return Joints(triangles, side, other, ends, ends_beyond)

    def equal(self, corner_values: Floats) -> Booleans:
        """Return whether values, (3 m, d), agree across each side at each of its ends, (s, 2)."""
        equal = np.ones(self.ends.shape, bool)
        for component in corner_values.T:
            equal &= component[self.ends] == component[self.ends_beyond]
        return equal


@dataclass(frozen=True, eq=False)
class Charts:
    """Where values at the corners of triangles run on continuously, and where they break: along seams.

    Attributes
    ----------
    triangles : (m, 3) int
    values : (m, 3, d) float64
    neighbours : (m, 3) int
        The triangle across the side opposite each corner, if the values run on across it; else -1.
    island : (m,) int
        Label of the connected part of the triangles.
    wedge : (m, 3) int
        Label of the corners around one vertex that have one value and hang together across sides.
    seam : (n,) bool
        Whether a vertex has several wedges.
    slit : (n,) bool
        Whether several of them lie in one island.
    """

    triangles: Integers
    values: Floats
    neighbours: Integers
    island: Integers
    wedge: Integers
    seam: Booleans
    slit: Booleans

    @staticmethod
    def of(joints: Joints, corner_values: Floats, equal: Booleans) -> Charts:
        """Find the charts of values, (3 m, d), at the corners of triangles; `equal` is `joints.equal` of them."""
        triangles, side, other = joints.triangles, joints.side, joints.other
        vertex = triangles.ravel()
        size, vertex_count = len(triangles), int(vertex.max()) + 1
        values = corner_values.reshape(size, 3, -1)
        wedge = _labels(3 * size, joints.ends[equal], joints.ends_beyond[equal])
        runs_on = equal.all(axis=1)
        island = _labels(size, side[runs_on] // 3, other[runs_on] // 3)
        neighbours = np.full(3 * size, -1)
        neighbours[side[runs_on]], neighbours[other[runs_on]] = other[runs_on] // 3, side[runs_on] // 3
        _, first = np.unique(wedge, return_index=True)
        seam = np.bincount(vertex[first], minlength=vertex_count) > 1
        pairs, counts = np.unique(vertex[first] * size + island[first // 3], return_counts=True)
        slit = np.zeros(vertex_count, bool)
        slit[pairs[counts > 1] // size] = True
        return Charts(triangles, values, neighbours.reshape(size, 3), island, wedge.reshape(size, 3), seam, slit)

    def wedges_at(self, vertices: Integers) -> tuple[Integers, Integers]:
        """Return a corner of every wedge at each of some vertices, and the row of `vertices` that it belongs to.

        A wedge that two islands share, which touch in a point of equal value, is there once for each.
        """
        key = self.wedge.ravel() * len(self.island) + np.repeat(self.island, 3)
        _, corner = np.unique(key, return_index=True)
        corner = corner[np.argsort(self.triangles.ravel()[corner], kind="stable")]
        around = self.triangles.ravel()[corner]
        start, stop = np.searchsorted(around, vertices), np.searchsorted(around, vertices, side="right")
        row = np.repeat(np.arange(len(vertices)), stop - start)
        offset = np.arange(len(row)) - np.repeat(np.cumsum(stop - start) - (stop - start), stop - start)
        return corner[start[row] + offset], row


@dataclass(frozen=True, eq=False)
class _BesideSeams:
    """The target's corners beside the seams of some charts, with what does not depend on the values.

    Attributes
    ----------
    charts : Charts
    source_vertices : (n_source, 3) float64
    corners : (c,) int
        Corners, 3 t + 0, 1 or 2, of target triangles.
    face, weights, place, group : (c,), (c, 3), (c, 3), (c,)
        Where each lies on the source, and to which of the groups that follow it belongs.
    middle, anchor, anchor_weights : (g, 3), (g,), (g, 3)
        Each group's middle, the source triangle it lies in, and where in it.
    """

    charts: Charts
    source_vertices: Floats
    corners: Integers
    face: Integers
    weights: Floats
    place: Floats
    group: Integers
    middle: Floats
    anchor: Integers
    anchor_weights: Floats

    def values(self, corner_values: Floats) -> Floats:
        """Return the values, (c, d), of the corners from source values, (3 m, d), that break at the same seams."""
        charts = replace(self.charts, values=corner_values.reshape(len(self.charts.triangles), 3, -1))
        at_anchor = np.einsum("gk,gkd->gd", self.anchor_weights, charts.values[self.anchor])
        its = self.group
        return _on_side_of_anchor(
            charts, self.source_vertices, self.face, self.weights, self.place,
            self.anchor[its], at_anchor[its], self.middle[its],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CornerInterpolation:
    """Carries values at the corners of source triangles to the corners of target triangles.

    All corners of a group take their values from one side of every seam of the source: the side that the group's anchor
    lies on, the middle of its largest triangle. A corner that lies beyond the seam takes the value at the seam, so that
    no value is a mean of two sides and no triangle is stretched from one to the other. Between two sides that hang
    together elsewhere (a slit in one island) a side ends where the value leaves the anchor's faster than it can.

    Attributes
    ----------
    correspondence : Correspondence
    source_vertices : (n_source, 3) float64
        Positions, to find what is nearest.
    target_triangles : (mt, 3) int
    groups : (mt,) int
        Which target triangles stay together, as the triangles of one polygon: numbers from 0.
    """

    correspondence: Correspondence
    source_vertices: Floats
    target_triangles: Integers
    groups: Integers

    def __call__(self, source_corner_values: npt.ArrayLike) -> tuple[Floats, Integers, Floats]:
        """Carry values, (3 ms, d), in the order of `correspondence.source_triangles`.

        Returns
        -------
        at_vertex : (n_target, d) float64
            The value of every corner at a vertex, but for those that follow; 0 where there is no counterpart.
        corners : (c,) int
            Corners, 3 t + 0, 1 or 2, of triangles beside a seam.
        values : (c, d) float64
            The values of these.
        """
        triangles = self.correspondence.source_triangles
        given = np.asarray(source_corner_values, dtype=np.float64).reshape(3 * len(triangles), -1)
        at_vertex = self._at_vertex @ given
        beside = self._beside_seams(given)
        if beside is None:
            return at_vertex, np.zeros(0, np.intp), np.zeros((0, given.shape[1]))
        return at_vertex, beside.corners, beside.values(given)

    def _beside_seams(self, given: Floats) -> _BesideSeams | None:
        """Find what lies beside the seams of values, (3 ms, d); None: nothing does."""
        equal = self._joints.equal(given)
        key = equal.tobytes()
        if key not in self._found:
            self._found.clear()  # the last one is kept: UV maps of one mesh often have the same seams
            self._found[key] = self._find_beside(Charts.of(self._joints, given, equal))
        return self._found[key]

    def _find_beside(self, charts: Charts) -> _BesideSeams | None:
        beside = self._groups_near_seams(charts)
        chosen = np.flatnonzero(beside[self.groups]) if beside.any() else np.zeros(0, np.intp)
        face, weights = self.correspondence.face, self.correspondence.barycentric
        corner_vertex = self.target_triangles[chosen].ravel()
        known = face[corner_vertex] >= 0
        corners = (3 * chosen[:, None] + np.arange(3)).ravel()[known]
        if len(corners) == 0:
            return None
        group = np.repeat(np.unique(self.groups[chosen], return_inverse=True)[1].reshape(-1), 3)
        place = self._place[corner_vertex].reshape(-1, 3, 3)
        middle, rank = _middles(place, known.reshape(-1, 3), group[::3])
        own_face = face[corner_vertex]
        anchors = _anchors(charts.triangles, self.source_vertices, middle, rank, own_face.reshape(-1, 3))
        return _BesideSeams(
            charts, self.source_vertices, corners, own_face[known], weights[corner_vertex[known]],
            place.reshape(-1, 3)[known], group[known], middle, *anchors,
        )  # fmt: skip

    @cached_property
    def _found(self) -> dict[bytes, _BesideSeams | None]:
        return {}

    @cached_property
    def _joints(self) -> Joints:
        return Joints.of(self.correspondence.source_triangles)

    @cached_property
    def _at_vertex(self) -> csr_array:
        """Takes values at source corners, (3 ms,), to target vertices; rows of 0 where there is no face."""
        face = self.correspondence.face
        corner = 3 * np.maximum(face, 0)[:, None] + np.arange(3)
        rows = np.arange(0, 3 * len(face) + 1, 3)
        shape = len(face), 3 * len(self.correspondence.source_triangles)
        return csr_array((self.correspondence.barycentric.ravel(), corner.ravel(), rows), shape=shape)

    @cached_property
    def _place(self) -> Floats:
        return _places(self.correspondence, self.source_vertices)[1]

    @cached_property
    def _circles(self) -> tuple[Floats, Floats]:
        """Centroid, (mt, 3), of each target triangle's place, and how far its corners lie from there, (mt,)."""
        corners = [self._place[self.target_triangles[:, k]] for k in range(3)]
        centre = (corners[0] + corners[1] + corners[2]) / 3
        square = np.max([((corner - centre) ** 2).sum(axis=1) for corner in corners], axis=0)
        return centre, np.sqrt(square)

    def _groups_near_seams(self, charts: Charts) -> Booleans:
        """Return which groups, (g,), lie on a seam, across one or beside a slit."""
        result = np.zeros(int(self.groups.max()) + 1, bool)
        if not charts.seam.any():
            return result
        face, weights = self.correspondence.face, self.correspondence.barycentric
        known = face >= 0
        # inside one island a vertex has one value, but for slits and for what lies on the seam itself
        off_seam = ~charts.seam[charts.triangles]
        on_seam = np.einsum("qk,qk->q", weights, off_seam[face]) < 1e-9
        touching = known & (on_seam | charts.slit[charts.triangles].any(axis=1)[face])
        island = np.where(known, charts.island[face], -1)
        corners = self.target_triangles.T
        a, b, c = (island[corner] for corner in corners)
        across = ((a != b) & (a >= 0) & (b >= 0)) | ((b != c) & (b >= 0) & (c >= 0)) | ((c != a) & (c >= 0) & (a >= 0))
        for corner in corners:
            across |= touching[corner]
        result[self.groups[across]] = True
        if charts.slit.any():
            centre, radius = self._circles
            rest = np.flatnonzero(~result[self.groups] & known[corners[0]] & known[corners[1]] & known[corners[2]])
            if len(rest):
                tree = KDTree(self.source_vertices[np.flatnonzero(charts.slit)])
                distance = tree.query(centre[rest], distance_upper_bound=radius[rest].max())[0]
                result[self.groups[rest[distance < radius[rest]]]] = True
        return result


def interpolate_corners(
    correspondence: Correspondence,
    source_vertices: Floats,
    source_corner_values: npt.ArrayLike,
    target_triangles: Integers,
    groups: Integers | None = None,
) -> Floats:
    """Return values at the corners of target triangles, (3 mt, d), from values at the corners of source triangles.

    Arguments as for `CornerInterpolation`; by default each triangle is a group of its own. 0 at corners whose vertex
    has no counterpart.
    """
    alone = np.arange(len(target_triangles)) if groups is None else groups
    carry = CornerInterpolation(correspondence, source_vertices, target_triangles, alone)
    at_vertex, corners, values = carry(source_corner_values)
    result = at_vertex[target_triangles.ravel()]
    result[corners] = values
    return result


def source_of_faces(
    correspondence: Correspondence, source_vertices: Floats, target_triangles: Integers, groups: Integers
) -> Integers:
    """Return the source triangle in which the middle of each group of target triangles lies, (g,); -1: none is known.

    The middle is that of the group's largest triangle. Arguments are those of `interpolate_corners`.
    """
    face, place = _places(correspondence, source_vertices)
    at = face[target_triangles]
    middle, rank = _middles(place[target_triangles], at >= 0, groups)
    result = np.full(len(middle), -1)
    found = np.flatnonzero(rank >= 0)
    corners = source_vertices[correspondence.source_triangles]
    result[found] = _nearest_triangles(corners, middle[found], at[rank[found]])[0]
    return result


def source_of_corners(
    correspondence: Correspondence, source_vertices: Floats, target_triangles: Integers, groups: Integers
) -> Integers:
    """Return the source triangle's corner (3 face + 0, 1 or 2) nearest to each corner of target triangles, (3 mt,).

    The corner is looked for from a tenth of the way to the middle of its group, so that it is found in the face
    on the same side of the vertex; -1 where the vertex has no counterpart. Arguments as for `interpolate_corners`.
    """
    face, place = _places(correspondence, source_vertices)
    at = face[target_triangles]
    middle, _ = _middles(place[target_triangles], at >= 0, groups)
    query = 0.9 * place[target_triangles.ravel()] + 0.1 * np.repeat(middle[groups], 3, axis=0)
    result = np.full(len(query), -1)
    found = np.flatnonzero(at.ravel() >= 0)
    corners = source_vertices[correspondence.source_triangles]
    nearest, weights = _nearest_triangles(corners, query[found], at.reshape(-1, 1)[found])
    result[found] = 3 * nearest + weights.argmax(axis=1)
    return result


def source_of_edges(
    correspondence: Correspondence, source_vertices: Floats, source_edges: Integers, target_edges: Integers
) -> Integers:
    """Return the source edge that runs along each target edge, (et,), from edges as pairs of vertices, (es, 2).

    Of the edges nearby it is the one with the least sum of its distance from the target edge's middle and of what the
    target edge's length loses by the angle between them; -1 where an end has no counterpart.
    """
    face, place = _places(correspondence, source_vertices)
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
    face, place = _places(correspondence, source_vertices)
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


def _places(correspondence: Correspondence, source_vertices: Floats) -> tuple[Integers, Floats]:
    """Return each target vertex's source triangle, (n,), and its place on the source, (n, 3)."""
    return correspondence.face, correspondence.matrix() @ source_vertices


def local_similarities(
    correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh
) -> tuple[Floats, Floats]:
    """Return how directions and lengths around each target vertex come from the source: (n, 3, 3) and (n,).

    The orthogonal matrix is the one that turns the sides of the triangles around a vertex, and the normal, best from
    the source onto the target (Kabsch 1976); a reflection everywhere if the map mirrors the surface, else nowhere.
    The scale is the ratio of the lengths of those sides. Both are the identity where no triangle is known whole.
    """
    face, place = _places(correspondence, source.vertices)
    triangles = target.faces[(face[target.faces] >= 0).all(axis=1)]
    size, count = len(face), len(triangles)
    corners = csr_array(
        (np.ones(3 * count), triangles.ravel().astype(np.int32), np.arange(0, 3 * count + 1, 3, dtype=np.int32)),
        shape=(count, size),
    )
    sums = corners.T @ _over_sides(np.hstack([place, target.vertices]), triangles)
    there_square, here_square, products = sums[:, 0], sums[:, 1], sums[:, 2:].reshape(-1, 3, 3)
    there_normal = interpolate(correspondence, source.vertex_normals())
    there_normal /= np.maximum(np.linalg.norm(there_normal, axis=1, keepdims=True), 1e-300)
    here_normal = target.vertex_normals()
    known = (there_square > 0) & (here_square > 0)
    weight = np.sqrt(there_square * here_square)[known, None, None]
    normals = here_normal[known, :, None] * there_normal[known, None]
    rotation = np.broadcast_to(np.eye(3), (size, 3, 3)).copy()
    rotation[known] = nearest_orthogonal(products[known] / weight + normals)
    scale = np.ones(size)
    scale[known] = np.sqrt(here_square[known] / there_square[known])
    return rotation, scale


def _over_sides(points: Floats, triangles: Integers) -> Floats:
    """Return sums over the three sides of each triangle, (m, 11), for two places of each point, (n, 6).

    Of each place's squared length, and the products of the components, (3, 3), of the second place by the first.
    """
    result = np.empty((len(triangles), 11))
    for first in range(0, len(triangles), _PIECE):
        piece = slice(first, first + _PIECE)
        corner = points[triangles[piece]].transpose(1, 2, 0).copy()
        u, v = corner[1] - corner[0], corner[2] - corner[0]
        p, q = 2 * u - v, 2 * v - u
        square = u * p + v * q
        result[piece, 0] = square[0] + square[1] + square[2]
        result[piece, 1] = square[3] + square[4] + square[5]
        for a in range(3):
            for b in range(3):
                result[piece, 2 + 3 * a + b] = u[3 + a] * p[b] + v[3 + a] * q[b]
    return result


def nearest_orthogonal(matrices: Floats) -> Floats:
    """Return the orthogonal matrices nearest to some, (n, 3, 3), all rotations or all reflections, as most are.

    The orthogonal factor of the polar decomposition by Newton's iteration (Higham 1986), for all matrices at once;
    where that is of the other kind or badly determined, from the singular values, the smallest of which changes sign
    (Kabsch 1976).
    """
    if len(matrices) == 0:
        return matrices
    factors = np.ascontiguousarray(matrices.transpose(1, 2, 0))
    determinant = _dot(factors[0], np.cross(factors[1], factors[2], axis=0))
    sign = np.sign(determinant)
    wanted = np.sign(sign.sum() or 1)
    odd = (sign != wanted) | (np.abs(determinant) < 1e-6 * np.einsum("abn,abn->n", factors, factors) ** 1.5)
    result = np.empty(matrices.shape)
    for first in range(0, len(matrices), _PIECE):
        piece = slice(first, first + _PIECE)
        factor = factors[:, :, piece].copy()
        factor[:, :, odd[piece]] = np.eye(3)[:, :, None]
        result[piece] = _orthogonal_factors(factor).transpose(2, 0, 1)
    left, _, right = np.linalg.svd(matrices[odd])
    left[np.sign(np.linalg.det(left @ right)) != wanted, :, 2] *= -1
    result[odd] = left @ right
    return result


def _orthogonal_factors(factor: Floats) -> Floats:
    """Return the orthogonal factors of the polar decompositions of well-conditioned matrices, (3, 3, n)."""
    for _ in range(30):
        inverse = _inverse_transposes(factor)
        balance = np.sqrt(np.sqrt((inverse**2).sum(axis=(0, 1)) / (factor**2).sum(axis=(0, 1))))
        step = 0.5 * (balance * factor + inverse / balance)
        change = np.abs(step - factor).max()
        factor = step
        if change < 1e-8:  # it converges quadratically
            break
    return factor


def _inverse_transposes(matrices: Floats) -> Floats:
    """Return the inverse of the transpose of each of some regular matrices, (3, 3, n): cofactors by determinant."""
    cofactors = np.empty_like(matrices)
    for k in range(3):
        a, b = matrices[k - 2], matrices[k - 1]
        for i in range(3):
            cofactors[k, i] = a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2]
    cofactors /= _dot(matrices[0], cofactors[0])
    return cofactors


def _dot(a: Floats, b: Floats) -> Floats:
    """Return dot products of columns, (n,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _labels(size: int, left: Integers, right: Integers) -> Integers:
    graph = coo_array((np.ones(left.size, np.int8), (left.ravel(), right.ravel())), shape=(size, size))
    return connected_components(graph, directed=False)[1].astype(np.intp)


def _middles(place: Floats, known: Booleans, group: Integers) -> tuple[Floats, Integers]:
    """Return each group's anchor point, (g, 3), and the triangle whose centroid it is, (g,); -1: nothing is known."""
    area = np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1)
    # whole triangles first, then those of which some corners are known
    order = np.lexsort((area, known.sum(axis=1)))
    triangle = np.full(int(group.max()) + 1, -1)
    triangle[group[order]] = order
    triangle[triangle >= 0] = np.where(known[triangle].any(axis=1), triangle, -1)[triangle >= 0]
    share = known[triangle] / np.maximum(known[triangle].sum(axis=1, keepdims=True), 1)
    return np.einsum("gk,gkd->gd", share, place[triangle]), triangle


def _anchors(
    triangles: Integers, vertices: Floats, middle: Floats, rank: Integers, face: Integers
) -> tuple[Integers, Floats]:
    """Return the source triangle nearest to each group's middle, (g,), and the barycentric coordinates there, (g, 3).

    -1 and 0 for groups of which nothing is known.
    """
    groups = np.flatnonzero(rank >= 0)
    anchor, weights = np.full(len(middle), -1), np.zeros((len(middle), 3))
    anchor[groups], weights[groups] = _nearest_triangles(vertices[triangles], middle[groups], face[rank[groups]])
    return anchor, weights


def _nearest_triangles(corners: Floats, query: Floats, guesses: Integers) -> tuple[Integers, Floats]:
    """Return the triangle of (m, 3, 3) nearest to each query, (q,), and the barycentric coordinates, (q, 3), in it.

    Tried are the guesses, (q, h), -1 for none, and the triangles whose middles are nearest, up to twelve, until no
    further one can be nearer.
    """
    centre = corners.mean(axis=1)
    size = np.sqrt(((corners - centre[:, None]) ** 2).sum(axis=2).max())
    best, best_distance = np.full(len(query), -1), np.full(len(query), np.inf)
    best_weights = np.zeros((len(query), 3))

    def attempt(rows: Integers, triangle: Integers) -> None:
        weights = nearest_in_triangle(query[rows], corners[triangle])
        distance = np.linalg.norm(np.einsum("qk,qkd->qd", weights, corners[triangle]) - query[rows], axis=1)
        nearer = distance < best_distance[rows]
        rows = rows[nearer]
        best[rows], best_distance[rows], best_weights[rows] = triangle[nearer], distance[nearer], weights[nearer]

    for k in range(guesses.shape[1]):
        rows = np.flatnonzero((guesses[:, k] >= 0) & (guesses[:, k] != best))
        attempt(rows, guesses[rows, k])
    open_rows = np.flatnonzero(best_distance > 1e-12 * size)
    tree = KDTree(centre) if len(open_rows) else None
    first = 0
    for count in (4, 12):
        if tree is None or len(open_rows) == 0 or first >= len(centre):
            break
        count = min(count, len(centre))
        away, near = (x.reshape(len(open_rows), count) for x in tree.query(query[open_rows], k=count))
        for k in range(first, count):
            # a triangle reaches no further from its middle than `size`
            can = best_distance[open_rows] > away[:, k] - size
            open_rows, away, near = open_rows[can], away[can], near[can]
            attempt(open_rows, near[:, k])
        first = count
    return best, best_weights


def _on_side_of_anchor(
    charts: Charts,
    vertices: Floats,
    face: Integers,
    weights: Floats,
    place: Floats,
    anchor_face: Integers,
    anchor_value: Floats,
    anchor_place: Floats,
) -> Floats:
    """Return the values, (q, d), at located points, each on the side of the seams that its anchor lies on."""
    flat = charts.values.reshape(-1, charts.values.shape[2])
    wanted = charts.island[anchor_face]
    corner = _corners_on_side(charts, face, anchor_face, anchor_value)
    own = 3 * face[:, None] + np.arange(3)
    wedge = charts.wedge.ravel()
    right = ((corner >= 0) & (wedge[corner] == wedge[own])) | (weights == 0)
    at_home = right.all(axis=1) & (charts.island[face] == wanted)
    # beyond the seam, only what lies on it has a value of the anchor's side
    kept = np.where((corner >= 0) & (at_home[:, None] | charts.seam[charts.triangles[face]]), weights, 0.0)
    total = kept.sum(axis=1)
    found = at_home | (total > 1e-6)
    kept[~at_home] /= np.maximum(total, 1e-6)[~at_home, None]
    values = np.einsum("qk,qkd->qd", kept, flat[corner])
    values[at_home] = np.einsum("qk,qkd->qd", weights[at_home], flat[own[at_home]])

    speed = np.maximum(_speed(charts, vertices, face), _speed(charts, vertices, anchor_face))
    gap = np.linalg.norm(values - anchor_value, axis=1)
    reach = _REACH * speed * np.linalg.norm(place - anchor_place, axis=1)
    beside_slit = at_home & (gap > reach) & (charts.island[face] == wanted)
    beside_slit &= ~charts.seam[charts.triangles[face]].any(axis=1)
    far = np.flatnonzero(~found | beside_slit)
    for label in np.unique(wanted[far]):
        rows = far[wanted[far] == label]
        members = np.flatnonzero(charts.island == label)
        corners = (3 * members[:, None] + np.arange(3)).ravel()
        corners = corners[np.unique(wedge[corners], return_index=True)[1]]
        where = vertices[charts.triangles.ravel()[corners]]
        tree = KDTree(where)
        # the first of the nearest that is on this side; of more of them only where none is
        for candidates in (16, 1024):
            k = min(candidates, len(corners))
            near = tree.query(place[rows], k=k)[1].reshape(len(rows), k)
            gap = np.linalg.norm(flat[corners[near]] - anchor_value[rows, None], axis=2)
            reach = _REACH * speed[rows, None] * np.linalg.norm(where[near] - anchor_place[rows, None], axis=2)
            within = gap <= reach
            first = np.where(within.any(axis=1), within.argmax(axis=1), gap.argmin(axis=1))
            values[rows] = flat[corners[near[np.arange(len(rows)), first]]]
            rows = rows[~within.any(axis=1)]
            if len(rows) == 0:
                break
    return values


def _corners_on_side(charts: Charts, face: Integers, anchor_face: Integers, anchor_value: Floats) -> Integers:
    """Return for each vertex of some triangles a corner of its wedge on the anchor's side, (q, 3); -1: there is none.

    Of several wedges in the anchor's island the one is taken that its triangle is in, then a neighbour of its triangle,
    then the one whose value is nearest.
    """
    flat = charts.values.reshape(-1, charts.values.shape[2])
    candidate, row = charts.wedges_at(charts.triangles[face].ravel())
    query = row // 3
    around = charts.neighbours[anchor_face]
    around = np.where(around < 0, anchor_face[:, None], around)
    wedge = charts.wedge.ravel()[candidate]
    in_anchor = (charts.wedge[anchor_face][query] == wedge[:, None]).any(axis=1)
    beside = (charts.wedge[around].reshape(len(face), 9)[query] == wedge[:, None]).any(axis=1)
    nearness = np.linalg.norm(flat[candidate] - anchor_value[query], axis=1)
    fits = in_anchor | (charts.island[candidate // 3] == charts.island[anchor_face][query])
    # np.lexsort sorts by its last key first
    order = np.lexsort((nearness, ~beside, ~in_anchor, ~fits, row))
    first = order[np.searchsorted(row[order], np.arange(3 * len(face)))]
    return np.where(fits[first], candidate[first], -1).reshape(-1, 3)


def _speed(charts: Charts, vertices: Floats, face: Integers) -> Floats:
    """Return how fast the value changes along the sides of triangles, (q,), at most."""
    sides = vertices[charts.triangles[face]]
    length = np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2)
    change = np.linalg.norm(charts.values[face] - np.roll(charts.values[face], 1, axis=1), axis=2)
    return np.divide(change, length, out=np.zeros_like(length), where=length > 0).max(axis=1)
