"""The conformal map of a closed surface to the unit sphere.

A vertex where the surface is fat is taken out with the triangles around it, what is left is mapped to the disc
(`harmonic.riemann_map`), and the disc to the sphere by inverse stereographic projection, the vertex at the pole that
it leaves out. Of the Möbius transformations that are left the one is taken after which the surface, by area, has its
barycentre in the centre of the ball: two such maps of one surface differ by a rotation alone. Choi, Lam and Lui,
"FLASH: Fast Landmark Aligned Spherical Harmonic Parameterization for Genus-0 Closed Brain Surfaces" (2015), is another
way, by the plane too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..surface.intrinsic_delaunay import IntrinsicTriangulation
from ..surface.kept import kept
from ..surface.laplacian import cotangents, mollified_lengths
from ..surface.mesh import Complexes, Floats, Integers, Places, TriangleMesh, edges_of_sides, twin_sides
from ..surface.sampling import edge_graph
from ..surface.statistics import weighted_median
from ..surface.topology import require_sphere
from .barycentre import spherical_barycentre
from .distortion import Distortion, spherical_distortion
from .domain import SPHERE, Domain
from .flatten import Flattening
from .harmonic import riemann_map
from .injective import untangled
from .locate import TriangulatedDisc
from .sphere_injective import require_injective, require_room, untangled_sphere

FAR_POINTS = 6
"""Points far from each other, from which on the whole the fattest place is least far: the ends of what juts out."""


@dataclass(frozen=True, eq=False)
class SphereFlattening:
    """A conformal map of a closed mesh to the unit sphere.

    Attributes
    ----------
    mesh : TriangleMesh
    sphere : (n, 3) float64
        Image of each vertex, of length 1 to rounding; nan at vertices in no face. Its area-weighted mean is 0.
    flips_repaired : int
        Triangles that were turned over in the conformal map and put right by moving the vertices around them.
    exact : (n, 3) float64 or None
        Where the vertices are; None: where the mesh has them, which was not smoothed for the computation.
    """

    mesh: TriangleMesh
    sphere: Floats
    flips_repaired: int = 0
    exact: Floats | None = None

    @property
    def places(self) -> Places:
        """The sphere: what `Flattening.places` is in the disc."""
        return self.sphere

    @property
    def domain(self) -> Domain:
        """Where the places are."""
        return SPHERE

    @kept
    def triangles(self) -> TriangulatedDisc:
        """The triangles in the sphere, prepared for point location."""
        return self.domain.triangulated(self.places, self.mesh.faces)

    @property
    def boundary(self) -> Integers:
        """None: (0,)."""
        return np.empty(0, np.intp)

    @property
    def holes(self) -> tuple[Integers, ...]:
        """None."""
        return ()

    @property
    def loops(self) -> tuple[Integers, ...]:
        """None."""
        return ()

    @property
    def rim_lost(self) -> float:
        """None."""
        return 0.0

    @kept
    def distortion(self) -> Distortion:
        """How far the map is from conformal."""
        return spherical_distortion(self.mesh, self.sphere)


Flat = Flattening | SphereFlattening


def flatten_sphere(mesh: TriangleMesh) -> SphereFlattening:
    """Map a closed triangle mesh without handles conformally to the unit sphere.

    Parameters
    ----------
    mesh : TriangleMesh
        A sphere in the sense of `topology`; vertices in no face are allowed.

    Returns
    -------
    SphereFlattening
        Injective: each triangle of geodesics is counter-clockwise seen from outside, in exact arithmetic, and all
        together cover the sphere once.

    Raises
    ------
    MeshError
        The mesh is no sphere, or has parts that shrink so much on it that numbers cannot tell their triangles apart,
        or that nothing can be matched there.

    Examples
    --------
    >>> corners = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    >>> flat = flatten_sphere(TriangleMesh(corners, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]))
    >>> bool(np.abs(flat.sphere @ flat.sphere.T - (4 * np.eye(4) - 1) / 3).max() < 1e-9)
    True
    """
    require_sphere(mesh)
    lengths = mollified_lengths(mesh.edge_lengths)
    sphere, before = np.zeros((len(mesh.vertices), 3)), 0
    for pole in _fattest(mesh):
        sphere = centred(_from(mesh, lengths, pole), mesh)
        before = spherical_distortion(mesh, sphere).flips
        if not before:
            break
        # few large triangles around one vertex may cross as geodesics, and not around another
        sphere = centred(untangled_sphere(mesh, lengths, sphere), mesh)
        if not spherical_distortion(mesh, sphere).flips:
            break
    require_injective(mesh, sphere)
    require_room(mesh, sphere)
    sphere[~mesh.used] = np.nan
    return SphereFlattening(mesh, sphere, before)


def _from(mesh: TriangleMesh, lengths: Floats, pole: int) -> Floats:
    """Return the map, (n, 3), that takes out a vertex; it is not centred."""
    around = (mesh.faces == pole).any(axis=1)
    faces, lengths = mesh.faces[~around], lengths[~around]
    twins = twin_sides(edges_of_sides(faces, len(mesh.vertices))[1])
    boundary = _link(mesh.faces[around], pole)
    disc = riemann_map(IntrinsicTriangulation(faces, lengths, twins, len(mesh.vertices)), boundary)
    disc = untangled(faces, lengths, disc, boundary)
    return _projected(_rounded(_scaled(disc, mesh, pole), faces, lengths), pole)


def centred(sphere: Floats, mesh: TriangleMesh) -> Floats:
    """Return points of the sphere, (n, 3), moved so that the mean of the mesh's vertices, by their area, is 0."""
    moved = spherical_barycentre(sphere[mesh.used], mesh.vertex_areas[mesh.used])(sphere)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def _fattest(mesh: TriangleMesh) -> list[int]:
    """Return the vertex that on the whole is least far along edges from points that are far from each other; and more.

    The others are for the case that the first will not do.
    """
    graph, inside = edge_graph(mesh), np.flatnonzero(mesh.used)
    place = int(inside[0])
    total, nearest = np.zeros(len(mesh.vertices)), np.full(len(mesh.vertices), np.inf)
    for number in range(FAR_POINTS + 1):
        distance = dijkstra(graph, indices=place)
        if number:  # the first point is any
            total += distance
            nearest = np.minimum(nearest, distance)
            distance = nearest
        place = int(inside[np.argmax(distance[inside])])
    order = inside[np.argsort(total[inside], kind="stable")]
    return order[np.unique([0, len(order) // 8, len(order) // 4, len(order) // 2])].tolist()


def _link(star: Integers, pole: int) -> Integers:
    """Return the vertices around a vertex, in the order in which they bound all but its own triangles, (k,)."""
    corner = np.argmax(star == pole, axis=1)
    row = np.arange(len(star))
    # the outside of a hole is passed the other way round than the triangles that fill it
    ahead = dict(zip(star[row, (corner + 2) % 3].tolist(), star[row, (corner + 1) % 3].tolist(), strict=True))
    loop = [next(iter(ahead))]
    while (following := ahead[loop[-1]]) != loop[0]:
        loop.append(following)
    return np.array(loop, dtype=np.intp)


def _scaled(disc: Complexes, mesh: TriangleMesh, pole: int) -> Complexes:
    """Return the disc in the scale in which half of the area lies within the unit circle."""
    areas = mesh.vertex_areas.copy()
    areas[pole] = 0
    return disc / max(weighted_median(np.abs(disc)[mesh.used], areas[mesh.used]), 1e-300)


def _rounded(plane: Complexes, faces: Integers, lengths: Floats, rounds: int = 2) -> Complexes:
    """Return the plane map after the linear map that brings it nearest to conformal on the sphere.

    The few vertices around the one that was taken out do not say well how the circle runs through them, and far from
    them what they say is that (a, b) is mapped to a p + b conj(p), p conformal. Of all linear maps with determinant 1
    the one is taken that makes the Dirichlet energy least, by area of the sphere: then both coordinates' are the same
    and they are orthogonal. It keeps every triangle's side.
    """
    cotangent = cotangents(lengths)
    for _ in range(rounds):
        corner = plane[faces]
        side = np.roll(corner, 1, axis=1) - np.roll(corner, -1, axis=1)
        weight = (cotangent.T / (1 + np.abs(corner.mean(axis=1)) ** 2) ** 2).T
        x, y = side.real, side.imag
        xx, xy, yy = ((weight * z).sum() for z in (x * x, x * y, y * y))
        size, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
        turn = vectors @ np.diag(size**-0.5 * np.prod(size) ** 0.25) @ vectors.T
        plane = (
            turn[0, 0] * plane.real + turn[0, 1] * plane.imag + 1j * (turn[1, 0] * plane.real + turn[1, 1] * plane.imag)
        )
    return plane


def _projected(plane: Complexes, pole: int) -> Floats:
    """Return the plane on the sphere, (n, 3), 0 above and the vertex that was taken out below."""
    square = np.abs(plane) ** 2
    sphere = np.stack([2 * plane.real, 2 * plane.imag, 1 - square], axis=1) / (1 + square)[:, None]
    sphere[pole] = 0, 0, -1
    return sphere
