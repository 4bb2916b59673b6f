"""Where values at the corners of triangles run on continuously, and where they break: along seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..surface.mesh import Booleans, Floats, Integers, directed_edges, edges_of_sides, twin_sides


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
        wedge = connected(3 * size, joints.ends[equal], joints.ends_beyond[equal])
        runs_on = equal.all(axis=1)
        island = connected(size, side[runs_on] // 3, other[runs_on] // 3)
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


def connected(size: int, left: Integers, right: Integers) -> Integers:
    """Return the number, (size,), of the connected part that each thing is in, linked `left` to `right`."""
    graph = coo_array((np.ones(left.size, np.int8), (left.ravel(), right.ravel())), shape=(size, size))
    return connected_components(graph, directed=False)[1].astype(np.intp)
