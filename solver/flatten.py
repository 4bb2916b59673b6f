"""The conformal map of a triangulated disc to the unit disc."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .circle import on_circle
from .distortion import Distortion, distortion, signed_areas
from .harmonic import riemann_map
from .injective import untangled
from .intrinsic_delaunay import IntrinsicTriangulation
from .laplacian import mollified_lengths
from .mesh import Complexes, Floats, Integers, TriangleMesh, edges_of_sides, twin_sides
from .mobius import Mobius, conformal_barycentre
from .topology import require_disc


@dataclass(frozen=True, eq=False)
class Flattening:
    """A conformal map of a mesh to the unit disc.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface.
    disc : (n,) complex128
        Image of each vertex, |disc| <= 1; nan at vertices in no face. Its area-weighted conformal barycentre is 0.
    boundary : (k,) int
        The boundary's vertices in order; their images lie on the unit circle, counter-clockwise.
    flips_repaired : int
        Triangles that were turned over in the conformal map and put right by moving the vertices around them.
    """

    mesh: TriangleMesh
    disc: Complexes
    boundary: Integers
    flips_repaired: int = 0

    @cached_property
    def distortion(self) -> Distortion:
        """How far the map is from conformal."""
        return distortion(self.mesh, self.disc)


def flatten(mesh: TriangleMesh, method: str = "harmonic") -> Flattening:
    """Map a triangulated disc conformally to the unit disc.

    Parameters
    ----------
    mesh : TriangleMesh
        A disc in the sense of `topology`; vertices in no face are allowed.
    method : str
        "harmonic": harmonic measure and harmonic extension.

    Returns
    -------
    Flattening
        Injective. Centred: the area-weighted conformal barycentre of the vertices is 0, so that two flattenings of one
        surface differ by a rotation alone.

    Raises
    ------
    MeshError
        The mesh is no disc.
    ValueError
        An unknown method.
    """
    if method != "harmonic":
        raise ValueError(f"unknown flattening method '{method}': use 'harmonic'")
    boundary = require_disc(mesh).boundary_loops[0]
    lengths = mollified_lengths(mesh.edge_lengths)
    disc = riemann_map(_surface(mesh, lengths), boundary, mesh.vertex_areas)

    used = np.unique(mesh.faces)
    centring = Mobius(conformal_barycentre(disc[used], mesh.vertex_areas[used]), 0.0)
    centred = np.full(len(disc), complex(np.nan, np.nan))
    centred[used] = centring(disc[used])
    centred[boundary] = on_circle(centred[boundary])
    turned = int((signed_areas(centred, mesh.faces) <= 0).sum())
    if turned:
        centred = untangled(mesh.faces, lengths, centred, boundary)
    return Flattening(mesh, centred, boundary, turned - int((signed_areas(centred, mesh.faces) <= 0).sum()))


def _surface(mesh: TriangleMesh, lengths: Floats) -> IntrinsicTriangulation:
    """Return the disc as an intrinsic triangulation; a vertex in the middle of one that is a single triangle."""
    n = len(mesh.vertices)
    if len(mesh.faces) > 1:
        return IntrinsicTriangulation(mesh.faces, lengths, twin_sides(mesh.edge_of_side), n)
    (a, b, c), (la, lb, lc) = mesh.faces[0], lengths[0]
    to = np.sqrt(2 * (lengths**2).sum() - 3 * lengths[0] ** 2) / 3
    faces = np.array([[a, b, n], [b, c, n], [c, a, n]])
    around = np.array([[to[1], to[0], lc], [to[2], to[1], la], [to[0], to[2], lb]])
    return IntrinsicTriangulation(faces, around, twin_sides(edges_of_sides(faces, n + 1)[1]), n + 1)
