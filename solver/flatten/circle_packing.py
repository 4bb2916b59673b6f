"""Circle packing of planar shapes: a silhouette's hexagonal lattice and the discrete conformal map of its circles.

Stephenson, "The approximation of conformal structures via circle packing" (1999); Rodin and Sullivan, "The convergence
of circle packings to the Riemann mapping" (1987). A circle for each vertex, tangent where an edge joins them, fills the
disc as the circles of the lattice fill the shape; those of the boundary touch the unit circle from inside. The radii
minimise a convex function (Colin de Verdière 1991), here by Newton's method.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_fill_holes, label
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from ..surface.cholesky import factorised
from ..surface.intrinsic_delaunay import IntrinsicTriangulation
from ..surface.mesh import (
    Booleans,
    Complexes,
    Floats,
    Integers,
    TriangleMesh,
    directed_edges,
    edges_of_sides,
    twin_sides,
)


def silhouette_mesh(silhouette: Booleans, circles: int = 2000, name: str = "silhouette") -> TriangleMesh:
    """Return the hexagonal lattice inside a silhouette as a triangulated disc in the plane z = 0.

    Parameters
    ----------
    silhouette : (height, width) bool
        True inside. Its largest connected part counts, holes filled.
    circles : int
        About how many lattice points lie inside.
    name : str
        Name of the mesh.

    Returns
    -------
    TriangleMesh
        x to the right and y up, in pixels; each boundary vertex has an inner neighbour.

    Raises
    ------
    ValueError
        The lattice has no inner point: an empty silhouette, or too few circles for its narrow parts.
    """
    if not silhouette.any():
        raise ValueError("the silhouette is empty")
    height, width = silhouette.shape
    parts = np.zeros((height, width), np.int32)
    label(silhouette, output=parts)
    inside = np.zeros((height, width), np.bool_)
    binary_fill_holes(parts == 1 + np.argmax(np.bincount(parts.ravel())[1:]), output=inside)
    spacing = np.sqrt(np.count_nonzero(inside) / (circles * np.sqrt(0.75)))
    vertices, faces, twins = _lattice(height, width, spacing)
    x, y = vertices.T
    row = np.clip(height - 1 - np.floor(y).astype(np.intp), -1, height)
    column = np.clip(np.floor(x).astype(np.intp), -1, width)
    member = np.pad(inside, 1)[row + 1, column + 1]

    # inner points have all six neighbours; the largest connected set of them keeps the faces around it
    beside = np.zeros(len(vertices), np.intp)
    np.add.at(beside, faces.ravel(), member[faces].all(axis=1).repeat(3))
    inner = beside == 6
    links = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    links = links[inner[links].all(axis=1)]
    part = connected_components(_graph(links, len(vertices)), directed=False)[1]
    if not inner.any():
        raise ValueError("no circle lies inside the silhouette: use more circles")
    inner &= part == np.argmax(np.bincount(part[inner]))
    kept = inner[faces].any(axis=1)

    # what the kept faces enclose belongs to them
    pairs = np.stack([np.arange(len(twins)) // 3, twins // 3], axis=1)[twins >= 0]
    outside = connected_components(_graph(pairs[~kept[pairs].any(axis=1)], len(faces)), directed=False)[1]
    at_rim = np.unique(outside[np.flatnonzero(twins < 0) // 3])
    faces = faces[kept | ~np.isin(outside, at_rim)]
    used = np.unique(faces)
    return TriangleMesh(np.pad(vertices[used], ((0, 0), (0, 1))), np.searchsorted(used, faces), name)


def packed(surface: IntrinsicTriangulation, boundary: Integers) -> Complexes:
    """Return the centres of the circles that fill the disc, (n,) complex128; 0 at vertices in no face.

    The centres are the hyperbolic ones, and for circles of the boundary their point of the unit circle. The lengths of
    the surface do not matter: the map is conformal for a lattice of equal triangles.

    Raises
    ------
    ValueError
        An inner edge joins two boundary vertices.
    """
    on_boundary = np.zeros(surface.vertex_count, bool)
    on_boundary[boundary] = True
    ends = directed_edges(surface.faces)[surface.inner_sides]
    if on_boundary[ends].all(axis=1).any() or on_boundary[surface.faces].all():
        raise ValueError("an edge across it joins two boundary vertices: subdivide it, or use the method 'harmonic'")
    return _layout(surface.faces, packing_radii(surface.faces, on_boundary), on_boundary)


def packing_radii(faces: Integers, on_boundary: Booleans, tolerance: float = 1e-10) -> Floats:
    """Return exp(-2 r) for the hyperbolic radius r of each circle, (n,): 0, so r infinite, on the boundary.

    Angles around each inner circle sum to 2 pi within `tolerance`. The unknowns are u = log tanh(r / 2), in which the
    derivatives of the angles are symmetric, and positive but for the diagonal.
    """
    n = len(on_boundary)
    inner = np.setdiff1d(faces, np.flatnonzero(on_boundary))
    place = np.full(n, -1)
    place[inner] = np.arange(len(inner))
    y = np.zeros(n)
    y[inner] = 0.5
    lack = 2 * np.pi - _angle_sums(faces, y)[inner]
    while np.abs(lack).max(initial=0) > tolerance:
        derivative = _angle_derivative(faces, y, place)
        step = factorised(derivative)(-lack)
        size, u = 1.0, np.log(np.tanh(-0.25 * np.log(y[inner])))
        while True:
            trial = y.copy()
            # u stays negative: towards 0 by at most nine tenths
            t = np.tanh(-0.5 * np.minimum(u + size * step, 0.1 * u))
            trial[inner] = t**2
            lack_trial = 2 * np.pi - _angle_sums(faces, trial)[inner]
            if np.linalg.norm(lack_trial) < np.linalg.norm(lack):
                break
            size *= 0.5
            if size < 1e-8:  # as near as rounding allows
                return y
        y, lack = trial, lack_trial
    return y


def _corner_angles(faces: Integers, y: Floats) -> Floats:
    """Return the angle at each corner, (m, 3), between the hyperbolic centres of three tangent circles."""
    own, left, right = y[faces], y[faces[:, [1, 2, 0]]], y[faces[:, [2, 0, 1]]]
    square = own * (1 - left) * (1 - right) / ((1 - own * left) * (1 - own * right))
    return 2.0 * np.arcsin(np.sqrt(np.clip(square, 0, 1)))


def _angle_sums(faces: Integers, y: Floats) -> Floats:
    return np.bincount(faces.ravel(), _corner_angles(faces, y).ravel(), len(y)).astype(np.float64, copy=False)


def _angle_derivative(faces: Integers, y: Floats, place: Integers) -> csc_array:
    """Return minus the derivative of the angle sums by u at the inner circles."""
    a, b = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    ya, yb, yc = y[a], y[b], y[faces[:, [2, 0, 1]].ravel()]
    both = np.sqrt(ya * yb * (1 - ya) * (1 - yb) * (1 - yc) / (1 - ya * yb * yc)) / (1 - ya * yb)
    # the angle at a by u_a: tan of half of it times what is left of the logarithmic derivative
    tangent = np.sqrt(ya * (1 - yb) * (1 - yc) / ((1 - ya) * np.maximum(1 - ya * yb * yc, 1e-300)))
    own = tangent * np.sqrt(ya) * (1 - ya) * (1 / np.maximum(ya, 1e-300) + yb / (1 - ya * yb) + yc / (1 - ya * yc))
    n = int(place.max()) + 1
    inner = (place[a] >= 0) & (place[b] >= 0)
    at = place[a] >= 0
    i, j = place[a[inner]], place[b[inner]]
    data = np.concatenate([-both[inner], -both[inner], own[at]])
    rows, columns = np.concatenate([i, j, place[a[at]]]), np.concatenate([j, i, place[a[at]]])
    return csc_array(coo_array((data, (rows, columns)), shape=(n, n)))


def _layout(faces: Integers, y: Floats, on_boundary: Booleans) -> Complexes:
    """Place the circles in generations, each beside two that are placed and of which one is inner."""
    angle = _corner_angles(faces, y).ravel()
    own, following, last = faces.ravel(), faces[:, [1, 2, 0]].ravel(), faces[:, [2, 0, 1]].ravel()
    # known circles `at` and `seen`, the third by its angle at `at` from `seen`
    at, seen, third = np.tile(own, 2), np.concatenate([following, last]), np.concatenate([last, following])
    turn = np.exp(1j * np.concatenate([angle, -angle]))
    usable = ~on_boundary[at]
    at, seen, third, turn = at[usable], seen[usable], third[usable], turn[usable]
    shrunk = np.sqrt(y[at] * y[third])  # exp(-(sum of both radii))
    away = (1 - shrunk) / (1 + shrunk)

    centres = np.zeros(len(y), np.complex128)
    placed = np.zeros(len(y), bool)
    start = int(np.argmax(y[at]))  # the smallest circle lies deep inside
    centres[third[start]] = away[start]
    placed[[at[start], third[start]]] = True
    while True:
        ready = np.flatnonzero(placed[at] & placed[seen] & ~placed[third])
        if not ready.size:
            return centres
        origin, known = centres[at[ready]], centres[seen[ready]]
        # at the end of a long limb points may coincide in floating point: their direction is lost then
        towards = (known - origin) * np.conj(1 - np.conj(origin) * known)
        length = np.abs(towards)
        moved = away[ready] * turn[ready] * np.divide(towards, length, out=np.ones_like(towards), where=length > 0)
        below = 1 + np.conj(origin) * moved
        centres[third[ready]] = np.divide(moved + origin, below, out=origin.copy(), where=below != 0)
        placed[third[ready]] = True


def _lattice(height: int, width: int, spacing: float) -> tuple[Floats, Integers, Integers]:
    """Return a hexagonal lattice over an image and two rings more: vertices, (n, 2), faces and their twin sides."""
    rise = np.sqrt(0.75) * spacing
    rows, columns = int(np.ceil(height / rise)) + 5, int(np.ceil(width / spacing)) + 6
    r, c = (index.ravel() for index in np.mgrid[:rows, :columns])
    vertices = np.stack([spacing * (c - 2 + 0.5 * (r % 2)), rise * (r - 2)], axis=1)
    r, c = (index.ravel() for index in np.mgrid[: rows - 1, : columns - 1])
    low, low_next = r * columns + c, r * columns + c + 1
    high, high_next = low + columns, low_next + columns
    leaning = r % 2 == 1  # odd rows are shifted, so the cell's short diagonal is the other one
    one = np.stack([low, low_next, np.where(leaning, high_next, high)], axis=1)
    other = np.stack([np.where(leaning, low, low_next), high_next, high], axis=1)
    faces = np.concatenate([one, other])
    return vertices, faces, twin_sides(edges_of_sides(faces, len(vertices))[1])


def _graph(links: Integers, count: int) -> coo_array:
    return coo_array((np.ones(len(links), np.int8), (links[:, 0], links[:, 1])), shape=(count, count))
