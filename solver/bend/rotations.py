"""How the surroundings of each vertex are turned, and embeddings with given turns (Sorkine and Alexa 2007)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from ..flatten.harmonic import factorised
from ..surface.laplacian import laplacian
from ..surface.mesh import Floats, Integers, TriangleMesh
from .plate import RIM_REACH

BEND_LENGTH = 0.15
"""Width over which the rotations of the target's surroundings are averaged: half the radius of a sheet rolled
half around, which must remain possible, and wide enough not to follow the Möbius map's errors."""

NEAR_BEND_LENGTH = 0.05
"""The same where it starts from a draft, whose errors are a third of the Möbius map's."""

SHARPEST_BEND_LENGTH = BEND_LENGTH / 4
"""The least width that `BEND_LENGTH` is halved to, while the Möbius map's errors do not account for what averaging does
away with."""

MOBIUS_ERROR = RIM_REACH
"""Root of the mean squared distance up to which averaging may move a surface from where the Möbius map puts it: as
smooth as the error of what is smoothed allows (Morozov's discrepancy principle)."""


def smooth_rotations(
    rest: TriangleMesh, now: Floats, trust: Floats | None = None, length: float = BEND_LENGTH
) -> Floats:
    """Return the rotation, (n, 3, 3), that carries the surroundings of each vertex of `rest` to those in `now`.

    Averaged over `length`, by trust, (n,).
    """
    trust = np.ones(len(now)) if trust is None else trust
    return _rotations(rest, _stiffness(rest), trust, length)(now)


def _rotations(rest: TriangleMesh, stiffness: csr_array, trust: Floats, length: float) -> Callable[[Floats], Floats]:
    """Return `smooth_rotations` as a function of `now` alone; `stiffness`: the mesh's, of `_stiffness`."""
    i, j = rest.edges.T
    weight = -np.asarray(stiffness[i, j]).ravel() * np.sqrt(trust[i] * trust[j])
    side = (rest.vertices[i] - rest.vertices[j])[:, None, :]
    average = factorised(csc_array(diags_array(rest.vertex_areas * trust) + length**2 * stiffness))

    def rotations(now: Floats) -> Floats:
        products = weight[:, None, None] * (now[i] - now[j])[:, :, None] * side
        total = _summed(i, products, len(now)) + _summed(j, products, len(now))
        u, _, v = np.linalg.svd(average(total.reshape(-1, 9)).reshape(-1, 3, 3))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
        return np.asarray(u @ v, np.float64)

    return rotations


def turned_like(rest: TriangleMesh, places: Floats, trust: Floats, length: float, rounds: int = 3) -> Floats:
    """Return `rest` with its surroundings turned as in `places`, as far as these are trusted, and its own lengths."""
    stiffness, areas = _stiffness(rest), rest.vertex_areas * trust
    i, j = rest.edges.T
    weight = -np.asarray(stiffness[i, j]).ravel()
    side = rest.vertices[i] - rest.vertices[j]
    # the places hold it only over lengths beyond the surface's width, which is 1
    solve = factorised(csc_array(stiffness + diags_array(areas)))
    rotations = _rotations(rest, stiffness, trust, length)
    now = places
    for _ in range(rounds):
        turn = rotations(now)
        wanted = weight[:, None] * np.einsum("eij,ej->ei", (turn[i] + turn[j]) / 2, side)
        now = solve(_summed(i, wanted, len(now)) - _summed(j, wanted, len(now)) + areas[:, None] * places)
    return now


def _stiffness(mesh: TriangleMesh) -> csr_array:
    """Return the cotangent Laplacian, (n, n), without its negative weights.

    Across an edge between two obtuse angles these push apart what should be turned alike.
    """
    stiffness = laplacian(mesh)
    links = stiffness - diags_array(stiffness.diagonal())
    links = csr_array(links.minimum(0))
    return csr_array(links - diags_array(np.asarray(links.sum(axis=1)).ravel()))


def coarsely_bent(flat: TriangleMesh, places: Floats, trust: Floats) -> Floats:
    """Return the mesh bent like its Möbius image, `places`: as smoothly as the image's errors allow."""
    weight = flat.vertex_areas * trust
    length = BEND_LENGTH
    while True:
        bent_like = turned_like(flat, places, trust, length)
        moved = weight @ ((bent_like - places) ** 2).sum(axis=1) / weight.sum()
        if moved <= MOBIUS_ERROR**2 or length <= SHARPEST_BEND_LENGTH:
            return bent_like
        length /= 2


def _summed(index: Integers, values: Floats, count: int) -> Floats:
    """Return the sums, (count, ...), of the values, (e, ...), that share an index."""
    flat = values.reshape(len(index), -1)
    sums = np.stack([np.bincount(index, column, count) for column in flat.T], axis=1)
    return sums.reshape(count, *values.shape[1:]).astype(np.float64, copy=False)
