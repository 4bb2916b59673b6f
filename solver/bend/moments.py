"""Rigid poses from moments: the principal axes of one surface laid along those of another, in every way.

They ask nothing of the discs, so that they are there where a conformal map is far from the right one: fingers, which it
shrinks to points, a body cut elsewhere. Where surfaces are bent between the scans no rigid pose fits, and they lose.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints
from .pose import in_pose, misfit

FEW, FEW_ROUNDS = 100, 5
"""Vertices, about, and closest point rounds by which the poses are compared.

On 12 pairs, mirrored and not, the best one was the same by three times as many vertices wherever it lay well.
"""

ASKED = 400
"""Vertices of either surface that say how well a pose lies, where poses are compared."""

KEPT = 3
"""Poses that are improved until they settle."""


def posed(mesh: TriangleMesh, onto: SurfacePoints) -> tuple[Floats, float]:
    """Return the vertices, (n, 3), of a surface in the rigid pose that lies best on another, and its `misfit`.

    Of the 24 turns that lay axes along axes, since those of nearly equal moments may be exchanged, each improved by
    closest points (`in_pose`). The mesh has the other's scale, and orientation, already.
    """
    middle, axes = _moments(mesh)
    other, other_axes = _moments(onto.mesh)
    tried = []
    for turn in _turns():
        x = (mesh.vertices - middle) @ (other_axes @ turn @ axes.T).T + other
        x = in_pose(TriangleMesh(x, mesh.faces), onto, FEW_ROUNDS, FEW)
        tried.append((misfit(TriangleMesh(x, mesh.faces), onto, ASKED), x))
    best, least = tried[0][1], np.inf
    for _, x in sorted(tried, key=lambda pair: pair[0])[:KEPT]:
        settled = in_pose(TriangleMesh(x, mesh.faces), onto)
        apart = misfit(TriangleMesh(settled, mesh.faces), onto)
        if apart < least:
            best, least = settled, apart
    return best, least


def _moments(mesh: TriangleMesh) -> tuple[Floats, Floats]:
    """Return the centre of area, (3,), and the principal axes, (3, 3), in columns, a right-handed frame."""
    share = mesh.vertex_areas / mesh.vertex_areas.sum()
    middle = share @ mesh.vertices
    arm = mesh.vertices - middle
    axes = np.linalg.eigh((share[:, None] * arm).T @ arm)[1]
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return middle, axes


def _turns() -> list[Floats]:
    """Return the 24 rotations, (3, 3), that map the coordinate axes onto each other."""
    all_ = [np.eye(3)[list(p)] * s for p in permutations(range(3)) for s in product((1.0, -1.0), repeat=3)]
    return [turn for turn in all_ if np.linalg.det(turn) > 0]
