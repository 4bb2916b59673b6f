"""The Riemann map of a triangulated disc by its harmonic measure.

The Green's function of the cotangent Laplacian with its pole at an interior vertex and zero on the boundary has the
harmonic measure as its flux through the boundary; the cumulated flux is the boundary angle of the Riemann map that
takes the pole to the centre, and the harmonic extension of that boundary is the map. One factorisation serves it all.
On an intrinsic Delaunay triangulation no weight is negative: the flux is none either, so the boundary keeps its order,
and by Tutte's theorem no triangle of that triangulation turns over.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array

from ..surface.cholesky import factorised
from ..surface.intrinsic_delaunay import IntrinsicTriangulation, edge_weights, with_interior, without_chords
from ..surface.mesh import Complexes, Floats, Integers
from .circle import angles_of_arcs


def riemann_map(surface: IntrinsicTriangulation, boundary: Integers) -> Complexes:
    """Return a conformal map of a disc to the unit disc, (n,) complex128; 0 at vertices in no face.

    Parameters
    ----------
    surface : IntrinsicTriangulation
        A disc; each triangle inequality holds strictly.
    boundary : (k,) int
        Its boundary's vertices in order, counter-clockwise.
    """
    count = surface.vertex_count
    surface = without_chords(with_interior(surface), boundary)
    interior, inner, outer = _dirichlet_systems(surface, boundary)
    solve = factorised(inner)

    pole = np.zeros(len(interior))
    # deepest inside: where a membrane under even load would give way most
    pole[np.argmax(solve(surface.vertex_areas[interior]))] = 1
    flux = np.maximum(outer.T @ solve(pole), 0)

    disc = np.zeros(surface.vertex_count, np.complex128)
    disc[boundary] = np.exp(1j * _angles(flux, _boundary_lengths(surface, boundary)))
    pulled = solve(outer @ np.stack([disc[boundary].real, disc[boundary].imag], axis=1))
    disc[interior] = pulled[:, 0] + 1j * pulled[:, 1]
    return disc[:count]


def _dirichlet_systems(surface: IntrinsicTriangulation, boundary: Integers) -> tuple[Integers, csc_array, csr_array]:
    """Return the interior vertices, their Laplacian and the weights that tie them to the boundary: A x = B values."""
    i, j, weight = edge_weights(surface)
    n = surface.vertex_count
    inside = np.zeros(n, bool)
    inside[surface.faces] = True
    inside[boundary] = False
    interior = np.flatnonzero(inside)
    place = np.empty(n, np.int32)  # what SuperLU takes
    place[interior] = np.arange(len(interior))
    place[boundary] = np.arange(len(boundary))

    proper = i != j
    i, j, weight = i[proper], j[proper], weight[proper]
    total = np.bincount(i, weight, minlength=n) + np.bincount(j, weight, minlength=n)
    both = inside[i] & inside[j]
    a, b, w = place[i[both]], place[j[both]], weight[both]
    own = np.arange(len(interior), dtype=np.int32)
    inner = coo_array(
        (np.concatenate([-w, -w, total[interior]]), (np.concatenate([a, b, own]), np.concatenate([b, a, own]))),
        shape=(len(interior), len(interior)),
    )
    one = inside[i] != inside[j]
    end, rim = np.where(inside[i], i, j)[one], np.where(inside[i], j, i)[one]
    outer = coo_array((weight[one], (place[end], place[rim])), shape=(len(interior), len(boundary)))
    return interior, csc_array(inner), csr_array(outer)


def _boundary_lengths(surface: IntrinsicTriangulation, boundary: Integers) -> Floats:
    """Return the length of the boundary's edge that begins at each of its vertices, (k,)."""
    sides = np.flatnonzero(surface.twins < 0)
    face, k = np.divmod(sides, 3)
    at = np.zeros(surface.vertex_count)
    at[surface.faces[face, (k + 1) % 3]] = surface.lengths.ravel()[sides]
    return at[boundary]


def _angles(flux: Floats, lengths: Floats) -> Floats:
    """Return the boundary angles, (k,), from the harmonic measure around each boundary vertex.

    A vertex shares its flux between its two edges by the square roots of their lengths: half way between an even
    share, which suits jagged boundaries, and one by lengths, which suits smooth ones (0.1 to 2 % of the angle error).
    """
    share = np.sqrt(lengths)
    density = flux / (share + np.roll(share, 1))
    return angles_of_arcs(share * (density + np.roll(density, -1)))
