"""The conformal map of a triangulated disc to the unit disc.

The Green's function of the cotangent Laplacian with its pole at an interior vertex and zero on the boundary has the
harmonic measure as its flux through the boundary; the cumulated flux is the boundary angle of the Riemann map that
takes the pole to the centre, and the harmonic extension of that boundary is the map. One factorisation serves it all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu

from .distortion import Distortion, distortion
from .laplacian import laplacian
from .mesh import Complexes, Floats, Integers, TriangleMesh
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
    """

    mesh: TriangleMesh
    disc: Complexes
    boundary: Integers

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
        Centred: the area-weighted conformal barycentre of the vertices is 0, so that two flattenings of one surface
        differ by a rotation alone.

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
    split = _with_interior(mesh, boundary)
    disc = _harmonic(split, boundary)[: len(mesh.vertices)]
    used = np.unique(mesh.faces)
    centring = Mobius(conformal_barycentre(disc[used], mesh.vertex_areas[used]), 0.0)
    centred = np.full(len(disc), complex(np.nan, np.nan))
    moved = centring(disc[used])
    centred[used] = moved / np.maximum(np.abs(moved), 1)
    centred[boundary] /= np.abs(centred[boundary])
    return Flattening(mesh, centred, boundary)


def _with_interior(mesh: TriangleMesh, loop: Integers) -> TriangleMesh:
    """Return the mesh with a vertex in the middle of each face that has all three vertices on the boundary.

    Such faces (corners that only touch the boundary, strips, a single triangle) would receive no flux at all.
    """
    rim = np.isin(mesh.faces, loop).all(axis=1)
    if not rim.any():
        return mesh
    first = len(mesh.vertices)
    middle = first + np.arange(rim.sum())
    a, b, c = mesh.faces[rim].T
    thirds = np.concatenate([np.stack(corners, axis=1) for corners in ((a, b, middle), (b, c, middle), (c, a, middle))])
    return TriangleMesh(
        np.concatenate([mesh.vertices, mesh.vertices[mesh.faces[rim]].mean(axis=1)]),
        np.concatenate([mesh.faces[~rim], thirds]),
        mesh.name,
    )


def _harmonic(mesh: TriangleMesh, loop: Integers) -> Complexes:
    """Return the Riemann map of a disc with interior vertices, (n,); 0 at vertices in no face."""
    stiffness = laplacian(mesh)
    interior = np.setdiff1d(mesh.faces, loop)
    to_boundary = csr_array(stiffness[interior][:, loop])
    solve = _factorised(csc_array(stiffness[interior][:, interior]))

    pole = np.zeros(len(interior))
    pole[_farthest_from(mesh, loop, interior)] = 1
    flux = -to_boundary.T @ solve(pole)
    # obtuse angles can make single fluxes negative: a floor keeps the boundary in order
    flux = np.maximum(flux, 1e-6 / len(loop))
    gaps = flux + np.roll(flux, -1)
    angles = 2 * np.pi * np.concatenate([[0], np.cumsum(gaps[:-1])]) / gaps.sum()

    disc = np.zeros(len(mesh.vertices), np.complex128)
    disc[loop] = np.exp(1j * angles)
    pulled = -to_boundary @ np.stack([disc[loop].real, disc[loop].imag], axis=1)
    disc[interior] = solve(pulled[:, 0]) + 1j * solve(pulled[:, 1])
    return disc


def _factorised(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return the solver of a sparse symmetric positive definite system."""
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve


def _farthest_from(mesh: TriangleMesh, loop: Integers, interior: Integers) -> int:
    """Return the position in `interior` of the vertex farthest from the boundary along edges."""
    n = len(mesh.vertices)
    i, j = mesh.edges.T
    length = np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1)
    graph = csr_array(coo_array((np.maximum(length, np.finfo(float).tiny), (i, j)), shape=(n, n)))
    distance = dijkstra(graph, directed=False, indices=loop, min_only=True)[interior]
    return int(np.argmax(np.where(np.isfinite(distance), distance, -1)))
