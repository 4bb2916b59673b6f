"""How directions and lengths around each target vertex come from the source: a rotation and a scale."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from ..surface.cholesky import factorised
from ..surface.laplacian import laplacian
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from .correspond import Correspondence
from .interpolate import interpolate, places

_PIECE = 2048
"""Of so many matrices everything fits in the processor's cache."""


def local_similarities(
    correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh, reach: float = 0.0
) -> tuple[Floats, Floats]:
    """Return how directions and lengths around each target vertex come from the source: (n, 3, 3) and (n,).

    The orthogonal matrix is the one that turns the sides of the triangles around a vertex, and the normal, best from
    the source onto the target (Kabsch 1976); a reflection everywhere if the map mirrors the surface, else nowhere.
    The scale is the ratio of the lengths of those sides. A vertex that rides along has its leader's. Both are the
    identity where no triangle is known whole.

    With a `reach`, in length units of the target, what is best is so for all that lies around within about that
    distance on the surface: sums over vertices are diffused by one implicit step of that length.
    """
    face, place = places(correspondence, source.vertices)
    triangles = target.faces[(face[target.faces] >= 0).all(axis=1)]
    size, count = len(face), len(triangles)
    corners = csr_array(
        (np.ones(3 * count), triangles.ravel().astype(np.int32), np.arange(0, 3 * count + 1, 3, dtype=np.int32)),
        shape=(count, size),
    )
    sums = corners.T @ _over_sides(np.hstack([place, target.vertices]), triangles)
    there_square, here_square, products = sums[:, 0], sums[:, 1], sums[:, 2:].reshape(-1, 3, 3)
    there_normal = interpolate(correspondence, source.vertex_normals())
    there_normal /= np.maximum(np.linalg.norm(there_normal, axis=1, keepdims=True), 1e-300)
    here_normal = target.vertex_normals() * _agreeing(correspondence, place, there_normal, triangles)[:, None]
    known = (there_square > 0) & (here_square > 0)
    weight = np.sqrt(there_square * here_square)[known, None, None]
    normals = here_normal[known, :, None] * there_normal[known, None]
    wanted = products[known] / weight + normals
    if reach > 0 and known.any():
        rotation, scale = _diffused(target, reach, known, wanted, there_square, here_square)
    else:
        rotation = np.broadcast_to(np.eye(3), (size, 3, 3)).copy()
        rotation[known] = nearest_orthogonal(wanted)
        scale = np.ones(size)
        scale[known] = np.sqrt(here_square[known] / there_square[known])
    if (leader := correspondence.leader) is not None:
        riders = np.flatnonzero(leader >= 0)
        rotation[riders], scale[riders] = rotation[leader[riders]], scale[leader[riders]]
    return rotation, scale


def _agreeing(correspondence: Correspondence, place: Floats, there_normal: Floats, triangles: Integers) -> Floats:
    """Return 1 or -1 at each target vertex, (n,): -1 in parts that are inside out beside their counterparts.

    As two artists' lashes may be, which have no inside. The main part's map, which may mirror, says what is not.
    """
    part = correspondence.part
    if part is None:
        return np.ones(len(place))
    corner = place[triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    along = np.einsum("md,md->m", across, there_normal[triangles].sum(axis=1))
    sums = np.bincount(np.maximum(part[triangles[:, 0]], 0), along, minlength=int(part.max(initial=0)) + 1)
    sign = np.where(sums * sums[0] < 0, -1.0, 1.0)
    return sign[np.maximum(part, 0)]


def _diffused(
    target: TriangleMesh, reach: float, known: Booleans, wanted: Floats, there_square: Floats, here_square: Floats
) -> tuple[Floats, Floats]:
    """Return rotations and scales of sums that are diffused from the known vertices; see `local_similarities`."""
    areas = np.maximum(target.vertex_areas, 1e-9 * target.area / len(known))
    sums = np.zeros((len(known), 11))
    sums[known, :9] = areas[known, None] * wanted.reshape(-1, 9)
    sums[:, 9], sums[:, 10] = there_square, here_square
    spread = factorised(csc_array(laplacian(target) + diags_array(areas / reach**2)))(sums)
    reached = (spread[:, 9:] > 1e-12 * np.abs(spread[:, 9:]).max(axis=0)).all(axis=1)
    rotation, scale = np.broadcast_to(np.eye(3), (len(known), 3, 3)).copy(), np.ones(len(known))
    rotation[reached] = nearest_orthogonal(spread[reached, :9].reshape(-1, 3, 3))
    scale[reached] = np.sqrt(spread[reached, 10] / spread[reached, 9])
    return rotation, scale


def _over_sides(points: Floats, triangles: Integers) -> Floats:
    """Return sums over the three sides of each triangle, (m, 11), for two places of each point, (n, 6).

    Of each place's squared length, and the products of the components, (3, 3), of the second place by the first.
    """
    result = np.empty((len(triangles), 11))
    for first in range(0, len(triangles), _PIECE):
        piece = slice(first, first + _PIECE)
        corner = points[triangles[piece]].transpose(1, 2, 0).copy()
        u, v = corner[1] - corner[0], corner[2] - corner[0]
        p, q = 2 * u - v, 2 * v - u
        square = u * p + v * q
        result[piece, 0] = square[0] + square[1] + square[2]
        result[piece, 1] = square[3] + square[4] + square[5]
        for a in range(3):
            for b in range(3):
                result[piece, 2 + 3 * a + b] = u[3 + a] * p[b] + v[3 + a] * q[b]
    return result


def nearest_orthogonal(matrices: Floats) -> Floats:
    """Return the orthogonal matrices nearest to some, (n, 3, 3), all rotations or all reflections, as most are.

    The orthogonal factor of the polar decomposition by Newton's iteration (Higham 1986), for all matrices at once;
    where that is of the other kind or badly determined, from the singular values, the smallest of which changes sign
    (Kabsch 1976).
    """
    if len(matrices) == 0:
        return matrices
    factors = np.ascontiguousarray(matrices.transpose(1, 2, 0))
    determinant = _dot(factors[0], np.cross(factors[1], factors[2], axis=0))
    sign = np.sign(determinant)
    wanted = np.sign(sign.sum() or 1)
    odd = (sign != wanted) | (np.abs(determinant) < 1e-6 * np.einsum("abn,abn->n", factors, factors) ** 1.5)
    result = np.empty(matrices.shape)
    for first in range(0, len(matrices), _PIECE):
        piece = slice(first, first + _PIECE)
        factor = factors[:, :, piece].copy()
        factor[:, :, odd[piece]] = np.eye(3)[:, :, None]
        result[piece] = _orthogonal_factors(factor).transpose(2, 0, 1)
    left, _, right = np.linalg.svd(matrices[odd])
    left[np.sign(np.linalg.det(left @ right)) != wanted, :, 2] *= -1
    result[odd] = left @ right
    return result


def _orthogonal_factors(factor: Floats) -> Floats:
    """Return the orthogonal factors of the polar decompositions of well-conditioned matrices, (3, 3, n)."""
    for _ in range(30):
        inverse = _inverse_transposes(factor)
        balance = np.sqrt(np.sqrt((inverse**2).sum(axis=(0, 1)) / (factor**2).sum(axis=(0, 1))))
        step = 0.5 * (balance * factor + inverse / balance)
        change = np.abs(step - factor).max()
        factor = step
        if change < 1e-8:  # it converges quadratically
            break
    return factor


def _inverse_transposes(matrices: Floats) -> Floats:
    """Return the inverse of the transpose of each of some regular matrices, (3, 3, n): cofactors by determinant."""
    cofactors = np.empty_like(matrices)
    for k in range(3):
        a, b = matrices[k - 2], matrices[k - 1]
        for i in range(3):
            cofactors[k, i] = a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2]
    cofactors /= _dot(matrices[0], cofactors[0])
    return cofactors


def _dot(a: Floats, b: Floats) -> Floats:
    """Return dot products of columns, (n,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
