"""The rigid pose in which one surface lies nearest to another's tangent planes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints
from .plate import pulls

POSE_ROUNDS = 10
"""Closest point rounds that improve the pose before anything bends."""


def in_pose(rest: TriangleMesh, onto: SurfacePoints) -> Floats:
    """Return the vertices of `rest` in the rigid pose nearest to the source's tangent planes.

    The scale stays: distances to planes fall when a surface merely shrinks.
    """
    areas, x = rest.vertex_areas / rest.area, rest.vertices
    for _ in range(POSE_ROUNDS):
        stiffness, force = pulls(x, rest.faces, areas, onto, np.zeros(len(x), bool))
        middle = areas @ x
        arm = x - middle
        # columns: shift and turn
        moves = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), _crossed(arm)], axis=2)
        square = np.einsum("nia,nij,njb->ab", moves, stiffness, moves, optimize=True)
        # a plane or a sphere slides along itself
        step = np.linalg.lstsq(square, np.einsum("nia,ni->a", moves, force), rcond=1e-9)[0]
        x = Rotation.from_rotvec(step[3:]).apply(arm) + middle + step[:3]
    return x


def _crossed(arm: Floats) -> Floats:
    """Return the matrices, (n, 3, 3), that carry a rotation vector to its cross product with each arm, (n, 3)."""
    return np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)
