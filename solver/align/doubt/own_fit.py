"""How far a surface that is moved as a rigid body, or mirrored, lies on itself; what reaches past it tells nothing."""

from __future__ import annotations

import numpy as np
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
        middles = np.indices(tuple(self._shape)).reshape(3, -1).T * size + self._low + size / 2
        self._near = used[KDTree(mesh.vertices[used]).query(middles)[1]]
        self._rim = np.zeros(len(mesh.vertices), bool)
        if onto.loops:
            self._rim[np.concatenate(onto.loops)] = True

    def roughly(self, points: Floats, normals: Floats) -> tuple[Booleans, Booleans, Integers]:
        """Return which points, (..., 3), lie about on the surface, which may lie past a boundary, and vertices nearby.

        By the cells.
        """
        cell = np.floor((points - self._low) / self._size).astype(np.intp)
        cell = np.clip(cell, 0, self._shape - 1)
        near = self._near[(cell[..., 0] * self._shape[1] + cell[..., 1]) * self._shape[2] + cell[..., 2]]
        apart = points - self.onto.mesh.vertices[near]
        close = (apart * apart).sum(axis=-1) < ROUGHLY_NEAR**2
        lying = close & ((normals * self.onto.normals[near]).sum(axis=-1) > ROUGHLY_ALONG)
        return lying, self._rim[near], near

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
