"""How values travel from the source to the target, domain by domain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ...solver import Correspondence, interpolate, interpolate_corners
from ...solver.interpolate import local_similarities, source_of_corners, source_of_edges, source_of_faces
from ...solver.mesh import Booleans, Floats, Integers
from ..mesh_data import Surface

Values = npt.NDArray[Any]
"""Values per element of a domain, of any type."""


@dataclass(frozen=True, eq=False)
class Carrier:
    """A correspondence with the two surfaces it connects."""

    correspondence: Correspondence
    source: Surface
    target: Surface

    def points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per vertex, (n_source, ...), linearly.

        Returns
        -------
        (n_target, ...) float64
            The values on the target's vertices.
        (n_target,) bool
            Where there is a value: the other vertices have no counterpart.
        """
        return interpolate(self.correspondence, values), self.correspondence.face >= 0

    def corners(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per face corner, (c_source, ...), never mixing the two sides of a seam; returns as `points`."""
        on_triangles = values[self.source.triangle_corners.ravel()]
        carried = interpolate_corners(
            self.correspondence,
            self.source.mesh.vertices,
            on_triangles,
            self.target.mesh.faces,
            self._polygon_of_triangle,
        )
        carried = carried.reshape(len(carried), *values.shape[1:])
        corners = self.target.triangle_corners.ravel()
        total = len(self.target.corner_vertex)
        result = np.zeros((total, *carried.shape[1:]))
        result[corners] = carried
        return result, self._whole_polygons[self.target.corner_polygon]

    def nearest_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per vertex, (n_source, ...), each from the nearest vertex; returns as `points`."""
        found = self.correspondence
        vertex = found.source_triangles[found.face, found.barycentric.argmax(axis=1)]
        return values[vertex], found.face >= 0

    def majority_of_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry booleans per vertex, (n_source,): true where at least half of the place is; returns as `points`."""
        share, covered = self.points(values)
        return share > 0.5 - 1e-9, covered

    def turned_points(self, values: Values) -> tuple[Values, Booleans]:
        """Carry quaternions per vertex, (n_source, 4), by their mean on the shorter way round; returns as `points`."""
        found = self.correspondence
        corners = values[found.source_triangles[found.face]].astype(np.float64)
        nearest = corners[np.arange(len(corners)), found.barycentric.argmax(axis=1)]
        same_half = np.where(np.einsum("qkd,qd->qk", corners, nearest) < 0, -1.0, 1.0)
        mean = np.einsum("qk,qkd->qd", found.barycentric * same_half, corners)
        length = np.linalg.norm(mean, axis=1)
        wanted = np.einsum("qk,qk->q", found.barycentric, np.linalg.norm(corners, axis=2))
        mean *= np.divide(wanted, length, out=np.ones_like(length), where=length > 0)[:, None]
        return mean, found.face >= 0

    def nearest_corners(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per face corner, (c_source, ...), each from the nearest corner; returns as `points`."""
        found = self._corner_origin
        result = np.zeros((len(found), *values.shape[1:]), values.dtype)
        result[found >= 0] = values[found[found >= 0]]
        return result, self._whole_polygons[self.target.corner_polygon]

    def faces(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per polygon, (p_source, ...), from the one that holds its middle; returns as `points`."""
        origin = self._polygon_origin
        return values[origin], origin >= 0

    def edges(self, values: Values) -> tuple[Values, Booleans]:
        """Carry values per edge, (e_source, ...), from the edge that runs along it; returns as `points`."""
        origin = self._edge_origin
        return values[origin], origin >= 0

    def displacements(self, values: Values) -> tuple[Values, Booleans]:
        """Carry vectors per vertex, (n_source, 3), turned and scaled with the surface; returns as `points`."""
        carried, covered = self.points(values)
        rotation, scale = self._similarities
        return np.einsum("nij,nj->ni", rotation, carried) * scale[:, None], covered

    @cached_property
    def _similarities(self) -> tuple[Floats, Floats]:
        return local_similarities(self.correspondence, self.source.mesh, self.target.mesh)

    @cached_property
    def _polygon_of_triangle(self) -> Integers:
        return self.target.corner_polygon[self.target.triangle_corners[:, 0]]

    @cached_property
    def _whole_polygons(self) -> Booleans:
        """Which polygons have a counterpart at every corner: one is carried as a whole or not at all."""
        bare = self.correspondence.face[self.target.corner_vertex] < 0
        return np.bincount(self.target.corner_polygon, bare) == 0

    @cached_property
    def _polygon_origin(self) -> Integers:
        triangle = source_of_faces(
            self.correspondence, self.source.mesh.vertices, self.target.mesh.faces, self._polygon_of_triangle
        )
        polygon = self.source.corner_polygon[self.source.triangle_corners[triangle, 0]]
        return np.where((triangle >= 0) & self._whole_polygons, polygon, -1)

    @cached_property
    def _corner_origin(self) -> Integers:
        corner = source_of_corners(
            self.correspondence, self.source.mesh.vertices, self.target.mesh.faces, self._polygon_of_triangle
        )
        result = np.full(len(self.target.corner_vertex), -1)
        origin = np.where(corner < 0, -1, self.source.triangle_corners.ravel()[corner])
        result[self.target.triangle_corners.ravel()] = origin
        return result

    @cached_property
    def _edge_origin(self) -> Integers:
        return source_of_edges(self.correspondence, self.source.mesh.vertices, self.source.edges, self.target.edges)
