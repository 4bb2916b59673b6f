"""Specimens and the maps between them, in their discs: points carried either way, and along paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..align.prepared import Surface
from ..flatten.locate import TriangulatedDisc
from ..flatten.sphere import require_open
from ..mobius import Mobius
from ..surface.mesh import Complexes, Floats, Integers
from ..surface.tidy import Cleaned


@dataclass(frozen=True, eq=False)
class Chart:
    """A specimen as maps see it.

    Attributes
    ----------
    vertices : (n, 3) float64
        Of the mesh in order, where they are.
    disc : (n,) complex128
    faces : (m, 3) int
    areas : (n,) float64
        Around the vertices.
    samples : (k,) int
        Vertices that stand for the whole.
    diagonal : float
    cleaned : Cleaned
        How it relates to the mesh as it came.
    """

    vertices: Floats
    disc: Complexes
    faces: Integers
    areas: Floats
    samples: Integers
    diagonal: float
    cleaned: Cleaned

    @staticmethod
    def of(surface: Surface, samples: int) -> Chart:
        """Return the chart of a prepared surface with its points chosen for a search."""
        flat, tidy = require_open(surface.flattening), surface.cleaned
        mesh = tidy.mesh
        chosen = surface.source_points(samples)
        return Chart(mesh.vertices, flat.disc, mesh.faces, mesh.vertex_areas, chosen, mesh.diagonal, tidy)

    @cached_property
    def located(self) -> TriangulatedDisc:
        """The disc, prepared for point location."""
        return TriangulatedDisc.of(self.disc, self.faces)

    def places(self, points: Complexes) -> Floats:
        """Return where points of the disc, (q,), lie on the surface, (q, 3)."""
        face, weights = self.located.locate(points)
        return np.einsum("qk,qkd->qd", weights, self.vertices[self.faces[face]])


@dataclass(frozen=True, eq=False)
class DiscMap:
    """A map between two specimens' discs.

    Attributes
    ----------
    source, target : Chart
    mobius : Mobius
        Carries the source's disc to the target's, where nothing is known beyond it.
    carried : (n_target,) complex128 or None
        Where the target's vertices go in the source's disc, by a dense map; nan at vertices in no face.
    """

    source: Chart
    target: Chart
    mobius: Mobius
    carried: Complexes | None = None

    def backward(self, points: Complexes) -> Complexes:
        """Return where points of the target's disc, (q,), go in the source's."""
        if self.carried is None:
            return self.mobius.inverse()(points)
        face, weights = self.target.located.locate(points)
        return (weights * self.carried[self.target.faces[face]]).sum(axis=1)

    def forward(self, points: Complexes) -> Complexes:
        """Return where points of the source's disc, (q,), go in the target's."""
        if self.carried is None:
            return self.mobius(points)
        face, weights = self._image.locate(np.conj(points) if self.mobius.reflected else points)
        return (weights * self.target.disc[self.target.faces[face]]).sum(axis=1)

    @cached_property
    def _image(self) -> TriangulatedDisc:
        """The target's triangles where they go, turned round again if they are mirrored."""
        assert self.carried is not None
        return TriangulatedDisc.of(np.conj(self.carried) if self.mobius.reflected else self.carried, self.target.faces)


@dataclass(frozen=True, eq=False)
class Step:
    """One map of a path, in the direction in which it is walked."""

    map: DiscMap
    backward: bool

    def __call__(self, points: Complexes) -> Complexes:
        """Return where points go."""
        return self.map.backward(points) if self.backward else self.map.forward(points)

    @property
    def end(self) -> Chart:
        """The specimen that it leads to."""
        return self.map.source if self.backward else self.map.target


def carried_along(points: Complexes, path: Sequence[Step]) -> Complexes:
    """Return where points of the disc of a path's first specimen, (q,), go in that of its last."""
    for step in path:
        points = step(points)
    return points


def mirrored(path: Sequence[Step]) -> bool:
    """Return whether a path turns orientation round."""
    return sum(step.map.mobius.reflected for step in path) % 2 == 1
