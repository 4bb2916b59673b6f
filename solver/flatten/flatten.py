"""The conformal map of a triangulated disc to the unit disc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mobius import Mobius
from ..surface.holes import filled
from ..surface.intrinsic_delaunay import IntrinsicTriangulation
from ..surface.kept import kept
from ..surface.laplacian import mollified_lengths
from ..surface.mesh import Complexes, Floats, Integers, MeshError, Places, TriangleMesh, edges_of_sides, twin_sides
from ..surface.topology import Topology, require_disc
from .barycentre import conformal_barycentre
from .circle import lost_rim, on_circle
from .circle_packing import packed
from .distortion import Distortion, distortion
from .domain import DISC, Domain
from .harmonic import riemann_map
from .injective import collapsed, require_injective, untangled
from .locate import TriangulatedDisc
from .mid_edge import mid_edge_map

METHODS = {"harmonic": riemann_map, "mid-edge": mid_edge_map, "circle-packing": packed}
"""Each takes an intrinsic triangulation and its boundary, and returns the disc."""


@dataclass(frozen=True, eq=False)
class Flattening:
    """A conformal map of a mesh to the unit disc.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface, without any filling.
    disc : (n,) complex128
        Image of each vertex, |disc| <= 1; nan at vertices in no face. Its area-weighted conformal barycentre is 0.
    boundary : (k,) int
        The outer boundary's vertices in order; their images lie on the unit circle, counter-clockwise.
    holes : tuple of (k,) int arrays
        Boundary loops that were closed for the computation; nothing is mapped to what they enclose.
    flips_repaired : int
        Triangles that were turned over in the conformal map and put right by moving the vertices around them.
    rim_lost : float
        Share of the outer boundary's length, in [0, 1], where numbers cannot carry its angles: see `circle.lost_rim`.
    exact : (n, 3) float64 or None
        Where the vertices are; None: where the mesh has them, which was not smoothed for the computation.
    """

    mesh: TriangleMesh
    disc: Complexes
    boundary: Integers
    holes: tuple[Integers, ...] = ()
    flips_repaired: int = 0
    rim_lost: float = 0.0
    exact: Floats | None = None

    @property
    def places(self) -> Places:
        """The disc: what `SphereFlattening.places` is on the sphere."""
        return self.disc

    @property
    def domain(self) -> Domain:
        """Where the places are."""
        return DISC

    @property
    def loops(self) -> tuple[Integers, ...]:
        """All boundary loops, the outer one first."""
        return (self.boundary, *self.holes)

    @kept
    def triangles(self) -> TriangulatedDisc:
        """The triangles in the disc, prepared for point location."""
        return self.domain.triangulated(self.places, self.mesh.faces)

    @kept
    def distortion(self) -> Distortion:
        """How far the map is from conformal."""
        return distortion(self.mesh, self.disc, self.boundary)


def flatten(
    mesh: TriangleMesh,
    method: str = "harmonic",
    *,
    fill_holes: bool = False,
    outer_vertex: int | None = None,
) -> Flattening:
    """Map a triangulated disc conformally to the unit disc.

    Parameters
    ----------
    mesh : TriangleMesh
        A disc in the sense of `topology`; vertices in no face are allowed.
    method : str
        "harmonic": harmonic measure and harmonic extension on intrinsic Delaunay weights (`harmonic.riemann_map`).
        "mid-edge": conjugate harmonic functions at the edges' midpoints (`mid_edge.mid_edge_map`).
        "circle-packing": a circle for each vertex, for a lattice of equal triangles (`circle_packing.packed`).
    fill_holes : bool
        Allow openings: all boundary loops but the outer one are closed for the computation (`holes.filled`).
    outer_vertex : int, optional
        A vertex on the loop that is to be the outer one, for `fill_holes`; by default the longest loop is.

    Returns
    -------
    Flattening
        Injective. Centred: the area-weighted conformal barycentre of the vertices is 0, so that two flattenings of one
        surface differ by a rotation alone.

    Raises
    ------
    MeshError
        The mesh is no disc, `outer_vertex` is on none of its boundary loops, the mesh is too coarse for the method, or
        so deep or narrow somewhere that numbers cannot tell its triangles apart in the disc.
    ValueError
        An unknown method.
    """
    if method not in METHODS:
        raise ValueError(f"unknown flattening method '{method}': use one of {', '.join(METHODS)}")
    boundary, holes = _outer_loop(mesh, require_disc(mesh, fill_holes=fill_holes), outer_vertex)
    surface = _surface(mesh, holes)
    try:
        disc = METHODS[method](surface, boundary)
    except ValueError as reason:
        raise MeshError(f"'{mesh.name}' is too coarse for the method '{method}': {reason}") from reason
    lost = lost_rim(mesh, disc, boundary)
    disc = _centred(disc, mesh)
    disc[boundary] = on_circle(disc[boundary])

    turned = _turned(disc, mesh)
    if turned:
        disc = untangled(surface.faces, surface.lengths, disc, boundary)
    require_injective(mesh, disc[: len(mesh.vertices)])
    result = np.full(len(mesh.vertices), complex(np.nan, np.nan))
    result[mesh.used] = disc[: len(result)][mesh.used]
    return Flattening(mesh, result, boundary, holes, turned - _turned(disc, mesh), lost)


def _centred(disc: Complexes, mesh: TriangleMesh) -> Complexes:
    """Return the disc moved so that the conformal barycentre of the mesh's vertices, by their area, is 0."""
    placed = disc[: len(mesh.vertices)][mesh.used]
    return Mobius(conformal_barycentre(placed, mesh.vertex_areas[mesh.used]), 0.0)(disc)


def _turned(disc: Complexes, mesh: TriangleMesh) -> int:
    """Return how many triangles of the mesh are turned over or collapsed in the disc."""
    return int(collapsed(disc, mesh.faces).sum())


def _surface(mesh: TriangleMesh, holes: tuple[Integers, ...]) -> IntrinsicTriangulation:
    """Return the disc that a mesh is when its holes are closed; the mesh's faces and vertices come first."""
    faces, lengths, count = filled(mesh, holes)
    twins = twin_sides(edges_of_sides(faces, count)[1]) if holes else mesh.twins
    return IntrinsicTriangulation(faces, mollified_lengths(lengths), twins, count)


def _outer_loop(mesh: TriangleMesh, found: Topology, vertex: int | None) -> tuple[Integers, tuple[Integers, ...]]:
    """Return the outer boundary loop and the others."""
    loops = found.boundary_loops
    if vertex is None:
        outer = int(np.argmax(found.loop_lengths))
    else:
        outer = next((k for k, loop in enumerate(loops) if vertex in loop), -1)
        if outer < 0:
            raise MeshError(f"'{mesh.name}' has vertex {vertex} on none of its boundary loops: choose one on the rim")
    return loops[outer], loops[:outer] + loops[outer + 1 :]
