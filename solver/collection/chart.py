"""Specimens and the maps between them, in their discs or spheres: points carried either way, and along paths.

Where a map has no counterpart for a point, it says so beside the nearest that it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..align.result.confidence import BOUND
from ..align.surfaces.prepared import Surface
from ..flatten.domain import Domain
from ..flatten.locate import TriangulatedDisc
from ..mobius import Mobius, SphereMobius
from ..surface.barycentric import interpolated
from ..surface.mesh import Booleans, Floats, Integers, Places
from ..surface.tidy import Cleaned

Carried = tuple[Places, Booleans]
"""Places in a domain, (q,), and which of these are counterparts, (q,); the others are the nearest that there are."""


@dataclass(frozen=True, eq=False)
class Chart:
    """A specimen as maps see it.

    Attributes
    ----------
    domain : Domain
    vertices : (n, 3) float64
        Of the mesh in order, where they are.
    places : (n,) complex128 or (n, 3) float64
        Where they are in the domain.
    faces : (m, 3) int
    areas : (n,) float64
        Around the vertices.
    samples : (k,) int
        Vertices that stand for the whole.
    diagonal : float
    cleaned : Cleaned
        How it relates to the mesh as it came.
    """

    domain: Domain
    vertices: Floats
    places: Places
    faces: Integers
    areas: Floats
    samples: Integers
    diagonal: float
    cleaned: Cleaned

    @staticmethod
    def of(surface: Surface, samples: int) -> Chart:
        """Return the chart of a prepared surface with its points chosen for a search."""
        flat, tidy = surface.flattening, surface.cleaned
        mesh = tidy.mesh
        chosen = surface.source_points(samples)
        return Chart(
            flat.domain, mesh.vertices, flat.places, mesh.faces, mesh.vertex_areas, chosen, mesh.diagonal, tidy
        )

    @cached_property
    def triangles(self) -> TriangulatedDisc:
        """The triangles in the domain, prepared for point location."""
        return self.domain.triangulated(self.places, self.faces)

    def positions(self, places: Places) -> Floats:
        """Return where points of the domain, (q,), lie on the surface, (q, 3)."""
        face, weights = self.triangles.locate(places)
        return interpolated(self.vertices, self.faces[face], weights)


@dataclass(frozen=True, eq=False)
class ChartMap:
    """A map between two specimens' domains.

    Attributes
    ----------
    source, target : Chart
    mobius : Mobius or SphereMobius
        Carries the source's domain to the target's, where nothing is known beyond it; else it counts whether it is
        reflected.
    carried : (n_target,) complex128, (n_target, 3) float64 or None
        Where the target's vertices go in the source's domain, by a dense map; nan at vertices in no face.
    paired : (n_target,) bool or None
        Which of them have a counterpart there, not only the nearest point that one has; None: all.
    """

    source: Chart
    target: Chart
    mobius: Mobius | SphereMobius
    carried: Places | None = None
    paired: Booleans | None = None

    def backward(self, points: Places) -> Carried:
        """Return where points of the target's domain, (q,), go in the source's."""
        if self.carried is None:
            return self.mobius.inverse()(points), np.ones(len(points), bool)
        face, weights = self.target.triangles.locate(points)
        corners = self.target.faces[face]
        places = self.source.domain.mean(self.carried, corners, weights)
        return places, (weights * self._paired[corners]).sum(axis=1) > 0.5

    def forward(self, points: Places) -> Carried:
        """Return where points of the source's domain, (q,), go in the target's.

        What lies farther from the image of the target than maps may err has no counterpart.
        """
        if self.carried is None:
            return self.mobius(points), np.ones(len(points), bool)
        face, weights = self._image.locate(self._seen(points))
        corners = self._image.faces[face]
        nearest = self.source.domain.mean(self.carried, corners, weights)
        apart = np.linalg.norm(self.source.positions(nearest) - self.source.positions(points), axis=1)
        known = (apart <= BOUND * self.source.diagonal) & self._paired.any()
        return self.target.domain.mean(self.target.places, corners, weights), known

    @cached_property
    def _paired(self) -> Booleans:
        return np.ones(len(self.target.places), bool) if self.paired is None else self.paired

    def _seen(self, places: Places) -> Places:
        return self.source.domain.reflected(places) if self.mobius.reflected else places

    @cached_property
    def _image(self) -> TriangulatedDisc:
        """The target's triangles that have a counterpart where they go, turned round again if they are mirrored."""
        assert self.carried is not None
        faces = self.target.faces
        some = self._paired[faces].all(axis=1)
        return self.source.domain.triangulated(self._seen(self.carried), faces[some] if some.any() else faces)


@dataclass(frozen=True, eq=False)
class Step:
    """One map of a path, in the direction in which it is walked."""

    map: ChartMap
    backward: bool

    def __call__(self, points: Places) -> Carried:
        """Return where points go."""
        return self.map.backward(points) if self.backward else self.map.forward(points)

    @property
    def end(self) -> Chart:
        """The specimen that it leads to."""
        return self.map.source if self.backward else self.map.target


def carried_along(points: Places, path: Sequence[Step]) -> Carried:
    """Return where points of the domain of a path's first specimen, (q,), go in that of its last.

    A point has a counterpart there if it has one at every step.
    """
    known = np.ones(len(points), bool)
    for step in path:
        points, here = step(points)
        known &= here
    return points, known


def mirrored(path: Sequence[Step]) -> bool:
    """Return whether a path turns orientation round."""
    return sum(step.map.mobius.reflected for step in path) % 2 == 1
