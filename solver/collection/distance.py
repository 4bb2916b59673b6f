"""How different two surfaces are in shape: the continuous Procrustes distance.

Lipman and Daubechies (2011) and Al-Aifari, Daubechies and Lipman, "Continuous Procrustes distance between two surfaces"
(2013): D(S, T)^2 is the infimum, over area-preserving maps C from T to S and rigid motions R, of the integral over T of
|R x - C x|^2, both surfaces scaled to area 1. Near its minimum C is nearly conformal, so they take a conformal map and
make it preserve areas. So is it done here: what is returned is the integral for such a C and its best R.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array, dia_array
from scipy.spatial import KDTree

from ..flatten.sphere import Flat
from ..surface.barycentric import interpolated
from ..surface.cholesky import factorised
from ..surface.laplacian import laplacian
from ..surface.mesh import Floats, Integers, Places
from ..surface.superimposing import superimposing

STEPS = 4
"""Steps of the flow: 8 and 16 change the distance of a cap of the sphere from a flat disc, known exactly, by less than
a twentieth of what it is off by."""

SPREAD = 4.0
"""Mean vertex areas over which carried area is spread: it comes in lumps, one for each vertex of the other mesh."""

LEAST = 0.01
"""Carried area over own area, at least: where nothing arrives the flow would be endless."""

POINTS = 1000
"""Points that the integral is taken at, where no others are given."""

GROUND = 1e-9
"""What holds the potential, which is free up to a constant, as a share of the vertex areas."""


class EvenFlow:
    """The flow on one surface that evens out whatever area another surface brings to it.

    Moser, "On the volume elements on a manifold" (1965): let u solve -div grad u = m - 1, where m is the carried area
    over the surface's own; then flowing for t from 0 to 1 with the velocity -grad u / ((1 - t) m + t) carries m to 1.
    Potentials and gradients are those of piecewise linear functions; the flow is followed in the disc or sphere.

    Parameters
    ----------
    surface : Flat
    """

    def __init__(self, surface: Flat) -> None:
        self.surface = surface
        self.areas = surface.mesh.vertex_areas / surface.mesh.area
        self.vertices = surface.mesh.vertices if surface.exact is None else surface.exact

    @cached_property
    def _solvers(self) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
        """What spreads carried areas, and what finds the potential."""
        size = len(self.areas)
        # vertices in no face have neither area nor neighbours
        held = np.where(self.surface.mesh.used, self.areas, 1.0)
        mass = dia_array((held[None], [0]), shape=(size, size))
        stiffness = laplacian(self.surface.mesh)
        spread = SPREAD / np.count_nonzero(self.surface.mesh.used)
        return factorised(csc_array(mass + spread * stiffness)), factorised(csc_array(stiffness + GROUND * mass))

    def evened(self, places: Places, face: Integers, barycentric: Floats, areas: Floats) -> Places:
        """Return where the flow takes places in the domain, (q,).

        Parameters
        ----------
        places : (q,) complex128 or (q, 3) float64
        face, barycentric, areas : (k,) int, (k, 3) float64, (k,) float64
            The area, of a total of 1, that was carried to points of the surface.
        """
        corners = self.surface.mesh.faces
        spreading, potential = self._solvers
        lumps = (areas[:, None] * barycentric).ravel()
        carried = np.bincount(corners[face].ravel(), lumps, len(self.areas)).astype(np.float64, copy=False)
        density = spreading(carried)
        lumps = self.areas * density
        slope = potential(lumps - self.areas * lumps.sum())
        density = np.maximum(density, LEAST)
        drift = -self._gradient(slope)
        moved = self.surface.domain.moved
        for step in range(STEPS):
            middle = moved(places, self._velocity(drift, density, places, step / STEPS) / (2 * STEPS))
            places = moved(places, self._velocity(drift, density, middle, (step + 0.5) / STEPS) / STEPS)
        return places

    def _velocity(self, drift: Places, density: Floats, places: Places, time: float) -> Places:
        face, weights = self.surface.triangles.locate(places)
        corners = self.surface.mesh.faces[face]
        there = (1 - time) * (weights * density[corners]).sum(axis=1) + time
        return interpolated(drift, corners, weights / there[:, None])

    def _gradient(self, values: Floats) -> Places:
        """Return the surface's gradient of values at vertices, (n,), as motion in the domain: means over the faces."""
        faces, places = self.surface.mesh.faces, self.surface.places
        # the gradient in the domain becomes the surface's by the squared conformal factor, the quotient of the areas:
        # what is summed over a vertex's faces is the gradient there times the area there
        there = np.maximum(self.surface.domain.flat_areas(places, faces), 0.0)
        gradient = self.surface.domain.gradients(places, faces, values[:, None])[..., 0]
        corner = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
        share = np.repeat(there / 3, 3) / np.where(self.areas > 0, self.areas, 1.0)[corner[0]]
        return csr_array((share, corner), shape=(len(values), len(faces))) @ gradient


def continuous_procrustes(
    source: EvenFlow,
    target: Flat,
    located: tuple[Integers, Floats],
    *,
    mirrored: bool,
    points: Integers | None = None,
) -> float:
    """Return the continuous Procrustes distance of two surfaces by a map between them, at least 0.

    Parameters
    ----------
    source : EvenFlow
        Of the surface that is mapped to.
    target : Flat
    located : (n_target,) int, (n_target, 3) float64
        The source's face, and where in it, that each target vertex goes to; -1 where it goes nowhere.
    mirrored : bool
        Whether the map turns orientation round: R does then too.
    points : (k,) int, optional
        Target vertices that the integral is taken at, spread evenly; by default every so many-th of all.
    """
    face, barycentric = located
    known = np.flatnonzero(face >= 0)
    points = known[:: -(-len(known) // POINTS)] if points is None else points[face[points] >= 0]
    areas = target.mesh.vertex_areas[known]
    areas = areas / areas.sum()
    corners = source.surface.mesh.faces
    start = source.surface.domain.mean(source.surface.places, corners[face[points]], barycentric[points])
    ends, weights = source.surface.triangles.locate(source.evened(start, face[known], barycentric[known], areas))
    onto = interpolated(source.vertices, corners[ends], weights) / np.sqrt(source.surface.mesh.area)
    exact = target.mesh.vertices if target.exact is None else target.exact
    here = exact[points] / np.sqrt(target.mesh.area)
    # each vertex's area counts at the nearest of the points
    spots = target.domain.coordinates(target.places)
    nearest = KDTree(spots[points]).query(spots[known])[1]
    share = np.bincount(np.asarray(nearest), areas, len(points)).astype(np.float64, copy=False)
    moved = superimposing(here, onto, share, mirrored=mirrored)(here)
    return float(np.sqrt(share @ ((moved - onto) ** 2).sum(axis=1)))
