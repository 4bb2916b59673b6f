"""Values at the corners of triangles, as of UV maps, carried without a mean across a seam."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from ..surface.barycentric import weighted
from ..surface.mesh import Booleans, Floats, Integers
from .charts import Charts, Joints
from .correspond import Correspondence
from .interpolate import places
from .seams import anchors_of, middles, on_side_of_anchor


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
        at_anchor = weighted(charts.values[self.anchor], self.anchor_weights)
        its = self.group
        return on_side_of_anchor(
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
        middle, rank = middles(place, known.reshape(-1, 3), group[::3])
        own_face = face[corner_vertex]
        anchors = anchors_of(charts.triangles, self.source_vertices, middle, rank, own_face.reshape(-1, 3))
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
        return places(self.correspondence, self.source_vertices)[1]

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
        on_seam = weighted(off_seam[face], weights) < 1e-9
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
