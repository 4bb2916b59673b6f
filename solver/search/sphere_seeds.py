"""Transformations to begin with: three pairs of points determine one, so few points leave few to try.

Surfaces leave far too many, and need none: what is like them rises to the right map from all around. Where points match
exactly or not at all, nothing tells of the right map next to it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..mobius import spinors
from ..surface.mesh import Booleans, Complexes, Floats, Integers
from .sphere_matching import SphereMatching

MOST_TRIPLES = 1 << 18
"""Triples of pairs that are gone through for one triple of source points; where there are more, none is tried."""

THREES = 16
"""Triples of source points: if two thirds of them have a counterpart, all of one triple do but in 3 cases of 1,000."""


def seeds(problem: SphereMatching, h_max: float) -> Iterator[Complexes]:
    """Yield coefficients of matrices that may have |h| <= h_max, (n, 4), triple of source points by triple."""
    counts = np.diff(problem.starts)
    spread = _spread(problem.source, np.flatnonzero(counts))
    psi, phi = spinors(problem.source), spinors(problem.centres)
    for j in spread[: len(spread) // 3 * 3].reshape(-1, 3):
        if counts[j].prod(dtype=np.float64) > MOST_TRIPLES:
            continue
        k = [problem.targets_of(i, i + 1) for i in j.tolist()]
        m, b = problem.source[j], [problem.centres[x] for x in k]
        first, second = np.nonzero(_alike(m[0], m[1], b[0], b[1], h_max))
        other = _alike(m[0], m[2], b[0], b[2], h_max)[first] & _alike(m[1], m[2], b[1], b[2], h_max)[second]
        row, third = np.nonzero(other)
        if len(row):
            yield through(psi[j], phi[k[0][first[row]]], phi[k[1][second[row]]], phi[k[2][third]])


def through(psi: Complexes, a: Complexes, b: Complexes, c: Complexes) -> Complexes:
    """Return the matrices, (n, 4), that carry three points of the sphere, (3, 2), to a, b and c, (n, 2) each."""
    one = a * (_det(c, b) / _det(psi[2], psi[1]))[:, None]
    two = b * (_det(a, c) / _det(psi[0], psi[2]))[:, None]
    matrix = np.stack([one, two], axis=2) @ np.linalg.inv(psi[:2].T)
    p, q, r, s = matrix.reshape(-1, 4).T
    return np.stack([p + s, q + r, 1j * (q - r), p - s], axis=1)


def _det(a: Complexes, b: Complexes) -> Complexes:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _alike(x: Floats, y: Floats, a: Floats, b: Floats, h_max: float) -> Booleans:
    """Return for which targets, (n, 3) and (k, 3), the chord may be that of x and y.

    Lengths grow by (1 - |h|^2) / |x - h|^2 at x, and chords by the geometric mean of that at both ends.
    """
    before, after = np.linalg.norm(x - y), np.linalg.norm(a[:, None] - b, axis=2)
    most = (1 + h_max) / (1 - h_max) * (1 + 1e-9)
    return (after <= most * before) & (before <= most * after) & (after > 1e-6)


def _spread(points: Floats, among: Integers) -> Integers:
    """Return some of the points, each as far from those before it as can be: neighbours determine little."""
    chosen = among[:1]
    apart = np.full(len(among), np.inf)
    while 0 < len(chosen) < min(3 * THREES, len(among)):
        apart = np.minimum(apart, np.linalg.norm(points[among] - points[chosen[-1]], axis=1))
        chosen = np.append(chosen, among[np.argmax(apart)])
    return chosen
