"""Rigid poses from moments: the principal axes of one surface laid along those of another, in every way.

They ask nothing of the discs, so that they are there where a conformal map is far from the right one: fingers, which it
shrinks to points, a body cut elsewhere. Where surfaces are bent between the scans no rigid pose fits, and they lose.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.superimposing import superimposing
from .pose import ASKED, FEW, MOST, in_pose, in_poses, misfit, misfits

FEW_ROUNDS = 5
"""Closest point rounds by which the poses are compared."""

KEPT = 3
"""Poses that are improved until they settle."""


def posed(mesh: TriangleMesh, onto: SurfacePoints, roughly: SurfacePoints) -> tuple[Floats, float]:
    """Return the vertices, (n, 3), of a surface in the rigid pose that lies best on another, and its `misfit`.

    Of the 24 turns that lay axes along axes, since those of nearly equal moments may be exchanged, each improved by
    closest points (`in_poses`). The mesh has the other's scale, and orientation, already; `roughly` is the other by few
    vertices, on which poses are compared: most lie far off, where a tree of many points takes long to answer.
    """
    middle, axes = _moments(mesh)
    other, other_axes = _moments(onto.mesh)
    starts = np.stack([(mesh.vertices - middle) @ (other_axes @ turn @ axes.T).T + other for turn in _turns()])
    tried = in_poses(mesh, starts, roughly, FEW_ROUNDS, FEW)
    apart = misfits(mesh, [_pose(mesh.vertices, x) for x in tried], roughly, ASKED)
    kept = in_poses(mesh, tried[np.argsort(apart, kind="stable")[:KEPT]], roughly)
    apart = misfits(mesh, [_pose(mesh.vertices, x) for x in kept], roughly, MOST)
    best = in_pose(mesh.moved(kept[int(np.argmin(apart))]), onto)
    return best, misfit(mesh.moved(best), onto)


def _pose(one: Floats, two: Floats) -> tuple[Floats, Floats]:
    """Return the rotation, (3, 3), and the shift, (3,), after it that carry points to others in another pose."""
    pose = superimposing(one, two)
    return pose.turn.T, pose.shift


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
