"""How values travel from the source to the target, domain by domain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ...solver import Correspondence, TriangleMesh
from ...solver.carry.contacts import brought_together
from ...solver.carry.corners import CornerInterpolation
from ...solver.carry.elements import edges_in_reach, source_of_corners, source_of_edges, source_of_faces
from ...solver.carry.fill import HarmonicFill, nearest_known, with_nearest
from ...solver.carry.frames import local_similarities
from ...solver.carry.gradients import GradientTransfer
from ...solver.carry.parts import drawn_apart, without_riders
from ...solver.surface.barycentric import weighted
from ...solver.surface.joining import first_of_place
from ...solver.surface.mesh import Booleans, Floats, Integers
from ..mesh_data import Surface

Values = npt.NDArray[Any]
"""Values per element of a domain, of any type."""


@dataclass(frozen=True, eq=False)
class Carrier:
    """A correspondence with the two surfaces it connects.

    Attributes
    ----------
    correspondence : Correspondence
    source, target : Surface
    gap : str
        What vertices without a counterpart get: "leave", nothing; the value of the "nearest" that has one; a harmonic
        "fill" between those, and the nearest where values cannot be mixed.
    keys_by : str
        How displacements get their direction and size: by "gradients" of the whole deformation (`GradientTransfer`), or
        each by the "frames" around its vertex (`local_similarities`).
    contacts : bool
        What a displacement brings together on the source, as lids and lips, is brought together too; by gradients only.
    own_parts : bool
        Whether a gap gets nothing from another part of the target.
    """

    correspondence: Correspondence
    source: Surface
    target: Surface
    gap: Literal["leave", "nearest", "fill"] = "leave"
    keys_by: Literal["gradients", "frames"] = "gradients"
    contacts: bool = True
    own_parts: bool = False

    @cached_property
    def own(self) -> Carrier:
        """Who carries what is a part's own, as UV maps and materials: nothing to parts without a counterpart."""
        if self.correspondence.leader is None:
            return self
        return replace(self, correspondence=without_riders(self.correspondence), own_parts=True)

    def points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per vertex, (n_source, ...), linearly.

        Returns
        -------
        (n_target, ...) float64
            The values on the target's vertices.
        (n_target,) bool
            Where there is a value: the other vertices have no counterpart.
        """
        return self.filled(self._matrix @ values.astype(np.float64))

    def corners(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per face corner, (c_source, ...), never mixing the two sides of a seam; returns as `points`."""
        at_vertex, rows, beside_seams = self._corner_interpolation(values[self.source.triangle_corners.ravel()])
        vertex = self.target.corner_vertex
        if values.dtype == np.float32:  # there are several corners to a vertex: no more bytes than will be written
            at_vertex = at_vertex.astype(np.float32)
        result = at_vertex.take(vertex, axis=0)
        result[self.target.triangle_corners.ravel()[rows]] = beside_seams
        result = result.reshape(len(vertex), *values.shape[1:])
        whole = self._whole_corners
        if self.gap == "leave" or whole.all():
            return result, whole
        if self.gap == "nearest":
            return result[self._nearest_corner], self._nearest_corner >= 0
        # around the gap each vertex gives the value of one of its corners beside it, never a mean across a seam
        known = self.correspondence.face[vertex] >= 0
        at_vertex = np.zeros((len(self.correspondence.face), *values.shape[1:]))
        at_vertex[vertex[known]] = result[known]
        beside = known & ~whole
        at_vertex[vertex[beside]] = result[beside]
        at_vertex, reached = self.filled(at_vertex)
        result[~known] = at_vertex[vertex[~known]]
        return result, np.bincount(self.target.corner_polygon, ~reached[vertex])[self.target.corner_polygon] == 0

    def nearest_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per vertex, (n_source, ...), each from the nearest vertex; returns as `points`."""
        found = self._everywhere.correspondence
        vertex = found.source_triangles[found.face, found.barycentric.argmax(axis=1)]
        return values[vertex], found.face >= 0

    def majority_of_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry booleans per vertex, (n_source,): true where at least half of the place is; returns as `points`."""
        share, covered = self.points(values)
        return share > 0.5 - 1e-9, covered

    def turned_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry quaternions per vertex, (n_source, 4), by their mean on the shorter way round; returns as `points`."""
        found = self._everywhere.correspondence
        corners = values[found.source_triangles[found.face]].astype(np.float64)
        nearest = corners[np.arange(len(corners)), found.barycentric.argmax(axis=1)]
        same_half = np.where(np.einsum("qkd,qd->qk", corners, nearest) < 0, -1.0, 1.0)
        mean = weighted(corners, found.barycentric * same_half)
        length = np.linalg.norm(mean, axis=1)
        wanted = weighted(np.linalg.norm(corners, axis=2), found.barycentric)
        mean *= np.divide(wanted, length, out=np.ones_like(length), where=length > 0)[:, None]
        return mean, found.face >= 0

    def nearest_corners(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per face corner, (c_source, ...), each from the nearest corner; returns as `points`."""
        found = self._corner_origin[self._nearest_corner]
        found[self._nearest_corner < 0] = -1
        result = np.zeros((len(found), *values.shape[1:]), values.dtype)
        result[found >= 0] = values[found[found >= 0]]
        return result, found >= 0

    def faces(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per polygon, (p_source, ...), from the one that holds its middle; returns as `points`."""
        first = np.searchsorted(self.target.corner_polygon, np.arange(len(self._whole_polygons)))
        corner = self._nearest_corner[first]
        origin = np.where(corner < 0, -1, self._polygon_origin[self.target.corner_polygon[corner]])
        return values[origin], origin >= 0

    def edges(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per edge, (e_source, ...), from the edge that runs along it; returns as `points`.

        Edges in a gap have none: a line that is nearest there would be drawn all over it.
        """
        covered = (self.correspondence.face[self.target.edges] >= 0).all(axis=1) & (len(values) > 0)
        marked = values.reshape(len(values), -1).astype(bool).any(axis=1)
        if values.dtype == object or marked.mean() > 0.3:
            return values[self._edge_origin], covered
        # few edges are marked, as seams are: look closer only beside these
        found, places, edges = self.correspondence, self._source_places, self.source.edges
        near = np.flatnonzero(edges_in_reach(found, places, edges, marked, self.target.edges))
        result = np.zeros((len(covered), *values.shape[1:]), values.dtype)
        result[near] = values[source_of_edges(found, places, edges, self.target.edges[near])]
        return result, covered

    def displacements(self, values: Values) -> tuple[Values, Booleans]:
        """Carry vectors per vertex, (n_source, 3), turned and scaled with the surface; returns as `points`."""
        if self.keys_by == "gradients":
            carried = self._gradients(values)
            if self.contacts:
                carried = brought_together(self._gradients, carried, self._gradients.moved_places(values))
            return self.filled(carried[self._first])
        rotation, scale = self._similarities
        carried = self._matrix @ values
        return self.filled(np.einsum("nij,nj->ni", rotation, carried) * scale[:, None])

    def normals(self, values: Values) -> tuple[Values, Booleans]:
        """Carry unit vectors per face corner, (c_source, 3), turned with the surface; returns as `points`.

        Those in a gap have none: Blender's own follow the surface there.
        """
        carried, _ = replace(self, gap="leave").corners(values)
        turned = np.einsum("cij,cj->ci", self._similarities[0][self.target.corner_vertex], carried)
        length = np.linalg.norm(turned, axis=1)
        return np.divide(turned, length[:, None], out=turned, where=length[:, None] > 0), self._whole_corners & (
            length > 0
        )

    def at(self, domain: str, weights: Floats) -> Floats:
        """Return weights of the target's vertices, (n_target,), on another domain: their mean over each element."""
        surface = self.target
        if domain == "EDGE":
            return weights[surface.edges].mean(axis=1)
        if domain == "CORNER":
            return weights[surface.corner_vertex]
        if domain == "FACE":
            sums = np.bincount(surface.corner_polygon, weights[surface.corner_vertex])
            return sums / np.bincount(surface.corner_polygon)
        return weights

    def filled(self, values: Values) -> tuple[Values, Booleans]:
        """Return values per vertex with the gap filled if it is to be, and where there is a value."""
        if self.gap == "leave" or (self.correspondence.face >= 0).all():
            return values, self.reached
        filled = values[self._nearest] if self.gap == "nearest" else self._fill(values)
        return filled, self.reached

    @property
    def mirrors(self) -> bool:
        """Whether the map takes the source to a mirror image."""
        return bool(np.linalg.det(self._similarities[0]).sum() < 0)

    @cached_property
    def reached(self) -> Booleans:
        """Which target vertices, (n_target,), get a value."""
        known = self.correspondence.face >= 0
        if self.gap == "leave" or known.all():
            return known
        return self._nearest >= 0 if self.gap == "nearest" else self._fill.reached

    @cached_property
    def _source_places(self) -> Floats:
        """Positions of the source's vertices, (n_source, 3), to look for what is near in the same part."""
        return drawn_apart(self.correspondence, self.source.mesh.vertices, self.target.mesh.faces)

    @cached_property
    def _matrix(self) -> csr_array:
        return self.correspondence.matrix()

    @cached_property
    def _corner_interpolation(self) -> CornerInterpolation:
        return CornerInterpolation(
            self.correspondence, self._source_places, self.target.mesh.faces, self._polygon_of_triangle
        )

    @cached_property
    def _fill(self) -> HarmonicFill:
        return HarmonicFill.of(self.target.mesh, self.correspondence.face >= 0)

    @cached_property
    def _nearest(self) -> Integers:
        return self._nearest_of(self.correspondence.face >= 0)

    def _nearest_of(self, known: Booleans) -> Integers:
        """Return the nearest of the known vertices, (n_target,), for each one, -1: none."""
        nearest, part = nearest_known(self.target.mesh, known), self.correspondence.part
        if not self.own_parts or part is None:
            return nearest
        return np.where((nearest >= 0) & (part[nearest] == part), nearest, -1)

    @cached_property
    def _nearest_corner(self) -> Integers:
        """The corner of the target whose value each corner takes, (c,): in a gap the nearest one outside; -1: none."""
        own, vertex = np.arange(len(self.target.corner_vertex)), self.target.corner_vertex
        whole = self._whole_corners
        if self.gap == "leave" or whole.all():
            return np.where(whole, own, -1)
        corner_at = np.full(len(self.correspondence.face), -1)
        corner_at[vertex[whole]] = own[whole]
        nearest = self._nearest_of(corner_at >= 0)
        return np.where(whole, own, np.where(nearest < 0, -1, corner_at[nearest])[vertex])

    @cached_property
    def _everywhere(self) -> Carrier:
        """For values that cannot be mixed: the gap has the counterparts of the nearest vertices that have one."""
        if self.gap == "leave":
            return self
        return replace(self, correspondence=with_nearest(self.correspondence, self._nearest), gap="leave")

    @cached_property
    def _similarities(self) -> tuple[Floats, Floats]:
        return local_similarities(self.correspondence, self.source.rest, self.target.rest)

    @cached_property
    def _first(self) -> Integers:
        """The first of the target's vertices, (n,), that each one is one with where a file has cut the surface open.

        Not where shape keys open it, on the target or on the source through the map.
        """
        own = [x for x in (self.target.keys, self.source.keys) if x is not None]
        if self.source.keys is not None:
            own[-1] = self._matrix @ self.source.keys
        return first_of_place(self.target.rest, np.concatenate(own, axis=1) if own else None)

    @cached_property
    def _gradients(self) -> GradientTransfer:
        found, rest, first = self.correspondence, self.target.rest, self._first
        if (first != np.arange(len(first))).any():
            rest = TriangleMesh(rest.vertices, first[rest.faces], rest.name)
            if found.leader is not None:
                found = replace(found, leader=np.where(found.leader >= 0, first[found.leader], -1))
        return GradientTransfer.of(found, self.source.rest, rest)

    @cached_property
    def _polygon_of_triangle(self) -> Integers:
        return self.target.corner_polygon[self.target.triangle_corners[:, 0]]

    @cached_property
    def _whole_polygons(self) -> Booleans:
        """Which polygons have a counterpart at every corner: one is carried as a whole or not at all."""
        bare = self.correspondence.face[self.target.corner_vertex] < 0
        return np.bincount(self.target.corner_polygon, bare) == 0

    @property
    def _whole_corners(self) -> Booleans:
        return self._whole_polygons[self.target.corner_polygon]

    @cached_property
    def _polygon_origin(self) -> Integers:
        triangle = source_of_faces(
            self.correspondence, self._source_places, self.target.mesh.faces, self._polygon_of_triangle
        )
        polygon = self.source.corner_polygon[self.source.triangle_corners[triangle, 0]]
        return np.where((triangle >= 0) & self._whole_polygons, polygon, -1)

    @cached_property
    def _corner_origin(self) -> Integers:
        corner = source_of_corners(
            self.correspondence, self._source_places, self.target.mesh.faces, self._polygon_of_triangle
        )
        result = np.full(len(self.target.corner_vertex), -1)
        origin = np.where(corner < 0, -1, self.source.triangle_corners.ravel()[corner])
        result[self.target.triangle_corners.ravel()] = origin
        return result

    @cached_property
    def _edge_origin(self) -> Integers:
        return source_of_edges(self.correspondence, self._source_places, self.source.edges, self.target.edges)
