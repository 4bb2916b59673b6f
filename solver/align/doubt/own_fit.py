"""How far a surface that is moved as a rigid body, or mirrored, lies on itself; what reaches past it tells nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from ...surface.mesh import Booleans, Floats, Integers
from ...surface.nearest import SurfacePoints
from ...surface.sampling import spread

ASKED = 500
"""Points of the surface, about, of which it is asked where they are moved to."""

FAR, NEAR, ALONG = 0.04, 0.015, 0.9
"""Distances in roots of the area, and cosine between normals, within which a moved point lies on the surface: while a
move is sought, and at last."""

CELLS = 40
"""Cells along the longest side of a box about the surface, in each of which the vertex next to its middle is known."""

BESIDE = 6
"""Cells from one with a vertex in it within which the vertex next to a cell's middle is sought; farther away, where no
point lies on the surface, one of the next cell with any is taken, in a tenth of the time: of a boundary's, if one is as
near as the cells tell."""

ROUGHLY_NEAR, ROUGHLY_ALONG = 0.06, 0.8
"""As `NEAR` and `ALONG` where cells answer and moves are some degrees apart: `FAR`, and half a cell of a sheet's."""


class OwnFit:
    """A surface, of about unit area, that is asked how well moved copies of it lie on it.

    Attributes
    ----------
    some : (q,) int
        About `ASKED` of its vertices, evenly spread.
    points, normals : (q, 3) float64
        Where they are, and the unit normals there.
    known : (k,) int
        These, and the vertices by which `roughly` answers.
    """

    def __init__(self, onto: SurfacePoints) -> None:
        self.onto = onto
        mesh, normals = onto.mesh, onto.normals
        used = np.flatnonzero(mesh.used)
        some = used[spread(mesh.vertices[used], ASKED)] if len(used) > ASKED else used
        self.some, self.points, self.normals = some, mesh.vertices[some], normals[some]
        low, high = mesh.vertices[used].min(axis=0), mesh.vertices[used].max(axis=0)
        size = float((high - low).max()) / CELLS
        self._low, self._size = low - size, size
        self._shape = np.ceil((high - low) / size).astype(np.intp) + 2
        self._rim = np.zeros(len(mesh.vertices), bool)
        if onto.loops:
            self._rim[np.concatenate(onto.loops)] = True
        self._near = self._nearby(used)
        self.known = np.union1d(some, self._near)

    def roughly(self, points: Floats, normals: Floats) -> tuple[Booleans, Booleans, Integers]:
        """Return which points, (..., 3), lie about on the surface, which may lie past a boundary, and vertices nearby.

        By the cells.
        """
        near = self._near[self._cells(points)]
        apart = points - self.onto.mesh.vertices[near]
        close = np.einsum("...k,...k->...", apart, apart) < ROUGHLY_NEAR**2
        lying = close & (np.einsum("...k,...k->...", normals, self.onto.normals[near]) > ROUGHLY_ALONG)
        return lying, self._rim[near], near

    def _cells(self, points: Floats) -> Integers:
        """Return in which cells points, (..., 3), are, or next to which if they are outside."""
        cell = np.clip(((points - self._low) / self._size).astype(np.intp), 0, self._shape - 1)
        return (cell[..., 0] * self._shape[1] + cell[..., 1]) * self._shape[2] + cell[..., 2]

    def _nearby(self, used: Integers) -> Integers:
        """Return of each cell the vertex, of those in use, (q,), next to its middle, or about so if all are far."""
        vertices = self.onto.mesh.vertices[used]
        away, near = self._of_next_cell(used)
        beside = np.flatnonzero(away < BESIDE)
        if self._rim.any():
            rim_away, rim = self._of_next_cell(np.flatnonzero(self._rim))
            near = np.where(rim_away <= away + np.sqrt(3), rim, near)  # a vertex is anywhere in its cell
        middles = np.stack(np.unravel_index(beside, tuple(self._shape)), axis=1) * self._size + self._low
        # boxes that are not shrunk to their points: half the time for queries that far from them
        tree = KDTree(vertices, compact_nodes=False, balanced_tree=False)
        near[beside] = used[tree.query(middles + self._size / 2)[1]]
        return near

    def _of_next_cell(self, some: Integers) -> tuple[Floats, Integers]:
        """Return how far, in cells, the next cell with one of some vertices, (k,), is from each, and one in it."""
        within = np.full(self._shape.prod(), -1)
        within[self._cells(self.onto.mesh.vertices[some])] = some
        full: Any = distance_transform_edt(within.reshape(self._shape) < 0, return_indices=True)
        away, at = full  # which its stubs do not know
        return away.ravel(), within[np.ravel_multi_index(tuple(at), tuple(self._shape))].ravel()

    def lying(self, points: Floats, normals: Floats, near: float) -> tuple[Floats, Booleans]:
        """Return the nearest points of the surface, (q, 3), and which points lie so near, and as it faces there.

        What has its nearest point on a boundary may lie past it.
        """
        other, close, at_rim = self._asked(points, normals, near)
        return other, close & ~at_rim

    def borne_out(self, points: Floats, normals: Floats, told: Booleans) -> tuple[float, float]:
        """Return which share of moved points lies on the surface: of those not past its boundaries, and of all.

        `told`, (q,): which points tell anything, as those do that the move does not leave where they are.
        """
        _, close, at_rim = self._asked(points, normals, NEAR)
        inside = told & ~at_rim
        lies = close & inside
        return float(lies.sum() / max(inside.sum(), 1)), float(lies.mean())

    def _asked(self, points: Floats, normals: Floats, near: float) -> tuple[Floats, Booleans, Booleans]:
        """Return the nearest points, (q, 3), which are so near and face so, and which of them are on a boundary."""
        other, facing, at_rim = self.onto.at(*self.onto.nearest_point(points, normals))
        close = np.linalg.norm(other - points, axis=1) < near
        return other, close & ((facing * normals).sum(axis=1) > ALONG), at_rim
