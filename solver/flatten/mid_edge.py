"""The mid-edge map of a triangulated disc: discrete harmonic functions and their conjugates at the edges' midpoints.

Pinkall and Polthier, "Computing Discrete Minimal Surfaces and Their Conjugates" (1993); Lipman and Funkhouser, "Möbius
Voting for Surface Correspondence" (2009); Lipman, Al-Aifari and Daubechies, "The Continuous Procrustes Distance Between
Two Surfaces" (2011). A face is cut out, u is harmonic with -1 and 1 at two of its corners and free on the boundary. The
conjugate u* lives at the midpoints; u + i u* maps the triangle between the midpoints of each face by a similarity, and
along the boundary u* is constant. So the surface goes to the plane outside a slit, and that to the disc by the inverse
of the Joukowski map.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order

from ..surface.cholesky import factorised
from ..surface.intrinsic_delaunay import IntrinsicTriangulation
from ..surface.laplacian import cotangent_laplacian, cotangents
from ..surface.mesh import Complexes, Floats, Integers


def mid_edge_map(surface: IntrinsicTriangulation, boundary: Integers) -> Complexes:
    """Return the mid-edge map of a disc to the unit disc, (n,) complex128, at the vertices; 0 at vertices in no face.

    Nothing keeps its triangles from turning over.

    Parameters
    ----------
    surface : IntrinsicTriangulation
        A disc, each triangle inequality strict.
    boundary : (k,) int
        Its boundary's vertices in order, counter-clockwise.

    Raises
    ------
    ValueError
        Every face has a vertex on the boundary, so that none can be cut out.
    """
    pole = _inner_face(surface, boundary)
    kept = np.delete(np.arange(len(surface.faces)), pole)
    faces, lengths, n = surface.faces[kept], surface.lengths[kept], surface.vertex_count
    u = _dipole(faces, lengths, n, surface.faces[pole])
    conjugate, edge_of_side = _conjugate(surface, kept, u)

    # linear in each face through its midpoints, then the mean over the faces around a vertex
    at_middle = conjugate[edge_of_side].reshape(-1, 3)
    at_corner = at_middle.sum(axis=1, keepdims=True) - 2 * at_middle
    around = np.bincount(faces.ravel(), minlength=n)
    mean = np.bincount(faces.ravel(), at_corner.ravel(), minlength=n) / np.maximum(around, 1)
    level = float(conjugate[edge_of_side[(surface.twins.reshape(-1, 3)[kept] < 0).ravel()]].mean())

    rim = u[boundary]
    middle, half = (rim.max() + rim.min()) / 2, (rim.max() - rim.min()) / 2
    w = (u - middle + 1j * (mean - level)) / half
    disc = w - np.sqrt(w - 1) * np.sqrt(w + 1)
    disc[boundary] = _around_slit((rim - middle) / half)
    disc[around == 0] = 0
    return disc


def _inner_face(surface: IntrinsicTriangulation, boundary: Integers) -> int:
    """Return a face deep inside, with no vertex on the boundary."""
    n = surface.vertex_count
    stiffness = cotangent_laplacian(surface.faces, surface.lengths, n)
    interior = np.setdiff1d(surface.faces, boundary)
    depth = np.zeros(n)
    if interior.size:
        inner = csc_array(stiffness[interior][:, interior])
        depth[interior] = factorised(inner)(surface.vertex_areas[interior])
    on_boundary = np.zeros(n, bool)
    on_boundary[boundary] = True
    of_face = np.where(on_boundary[surface.faces].any(axis=1), -np.inf, depth[surface.faces].sum(axis=1))
    best = int(np.argmax(of_face))
    if np.isneginf(of_face[best]):
        raise ValueError("every face has a vertex on the boundary: subdivide it, or use the method 'harmonic'")
    return best


def _dipole(faces: Integers, lengths: Floats, n: int, pole: Integers) -> Floats:
    """Return the harmonic function, (n,), with -1 and 1 at the first two corners of the face that was cut out."""
    stiffness = cotangent_laplacian(faces, lengths, n)
    u = np.zeros(n)
    u[pole[:2]] = -1, 1
    free = np.setdiff1d(faces, pole[:2])
    rows = stiffness[free]
    u[free] = factorised(csc_array(rows[:, free]))(-(rows @ u))
    return u


def _conjugate(surface: IntrinsicTriangulation, kept: Integers, u: Floats) -> tuple[Floats, Integers]:
    """Return u* at the midpoints, one per edge, and the edge of each side of the faces `kept`.

    In face (a, b, c): u*(middle of ab) - u*(middle of ca) = (cot c (u_a - u_b) + cot b (u_a - u_c)) / 2.
    """
    side = np.arange(len(surface.twins))
    edge_of_side = np.where(surface.twins >= 0, np.minimum(side, surface.twins), side).reshape(-1, 3)[kept]
    cotangent, value = cotangents(surface.lengths[kept]), u[surface.faces[kept]]
    following, last = [1, 2, 0], [2, 0, 1]
    step = 0.5 * (
        cotangent[:, last] * (value - value[:, following]) + cotangent[:, following] * (value - value[:, last])
    )
    start, stop = edge_of_side[:, following].ravel(), edge_of_side[:, last].ravel()  # middles of ca and of ab
    rows, columns = np.concatenate([start, stop]), np.concatenate([stop, start])
    steps = csr_array(
        coo_array((np.concatenate([step.ravel(), -step.ravel()]), (rows, columns)), shape=(side.size,) * 2)
    )
    linked = csr_array(coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(side.size,) * 2))
    order, before = breadth_first_order(linked, edge_of_side[0, 0], directed=False)
    total = np.zeros(side.size)
    total[order[1:]] = steps[before[order[1:]], order[1:]]
    before = np.where(before < 0, side, before)
    # each round doubles the length of the way back that is summed
    while (before[before] != before).any():
        total += total[before]
        before = before[before]
    return total, edge_of_side.ravel()


def _around_slit(rim: Floats) -> Complexes:
    """Return the points of the circle over points of the slit [-1, 1], (k,), passed counter-clockwise in the disc.

    The disc's inverse Joukowski map takes angle t to cos t; one way from 1 to -1 is the upper half of the circle.
    """
    k = len(rim)
    ahead = (np.arange(k) - int(np.argmax(rim))) % k
    angle = np.arccos(np.clip(rim, -1, 1))
    below = ahead > ahead[int(np.argmin(rim))]
    return np.exp(1j * np.where(below, -angle, angle))
