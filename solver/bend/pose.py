"""The rigid pose in which one surface lies nearest to another's tangent planes, and how well it lies there."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.statistics import weighted_median
from .plate import pulls

POSE_ROUNDS = 30
"""Closest point rounds, at most, that improve the pose before anything bends."""

POSE_SETTLED = 1e-3
"""Length, in roots of the source's area, that a round moves points by when the pose has settled."""

HELD = 0.01
"""What resists a move of the pose, as a share of springs on everything: where hardly anything is pulled, it stays."""

PROCRUSTES_ROUNDS = 20
"""Rounds of reweighting in which a rigid pose settles on the places that it can reach."""

MOST = 2000
"""Vertices that are asked for their distance, at most."""

FAR = 0.1
"""Distance, in roots of the source's area, from which on a point counts as not lying on the other surface at all."""


def in_pose(rest: TriangleMesh, onto: SurfacePoints, rounds: int = POSE_ROUNDS) -> Floats:
    """Return the vertices of `rest` in the rigid pose nearest to the source's tangent planes, after so many rounds.

    The scale stays: distances to planes fall when a surface merely shrinks.
    """
    areas, x = rest.vertex_areas / rest.area, rest.vertices
    for _ in range(rounds):
        stiffness, force = pulls(x, rest.faces, areas, onto, np.zeros(len(x), bool))
        middle = areas @ x
        arm = x - middle
        # columns: shift and turn
        moves = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), _crossed(arm)], axis=2)
        stiffness = stiffness + HELD * areas[:, None, None] * np.eye(3)
        square = np.einsum("nia,nij,njb->ab", moves, stiffness, moves, optimize=True)
        step = np.linalg.solve(square, np.einsum("nia,ni->a", moves, force))
        x = Rotation.from_rotvec(step[3:]).apply(arm) + middle + step[:3]
        if np.linalg.norm(step[:3]) + np.linalg.norm(step[3:]) < POSE_SETTLED:
            break
    return x


def rigidly(flat: TriangleMesh, places: Floats, trust: Floats) -> Floats:
    """Return the mesh, unbent, in the rigid pose that most of the places, (n, 3), agree with, by trust, (n,).

    Least squares (Kabsch 1976), reweighted by Cauchy's weights about the median distance.
    """
    base = flat.vertex_areas * trust
    weight, x = base, flat.vertices
    for _ in range(PROCRUSTES_ROUNDS):
        share = weight / weight.sum()
        middle, other = share @ flat.vertices, share @ places
        left, _, right = np.linalg.svd((share[:, None] * (places - other)).T @ (flat.vertices - middle))
        left[:, 2] *= np.sign(np.linalg.det(left @ right))
        x = (flat.vertices - middle) @ (left @ right).T + other
        distance = np.linalg.norm(x - places, axis=1)
        weight = base / (1 + (distance / max(weighted_median(distance, base), 1e-6)) ** 2)
    return x


def misfit(mesh: TriangleMesh, onto: SurfacePoints) -> float:
    """Return how badly two surfaces lie on each other: the mean distance in position and normal, either way.

    Distances count up to `FAR`; normals by the surface's own weight.
    """
    back = SurfacePoints(mesh, (), onto.normal_weight)
    return (_mean_distance(mesh, onto) + _mean_distance(onto.mesh, back)) / 2


def _mean_distance(mesh: TriangleMesh, onto: SurfacePoints) -> float:
    some = slice(None, None, -(-len(mesh.vertices) // MOST))
    points, normals = mesh.vertices[some], mesh.vertex_normals()[some]
    face, barycentric = onto.most_alike(points, normals)
    corners = onto.mesh.faces[face]
    point = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[corners])
    normal = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertex_normals()[corners])
    square = ((point - points) ** 2).sum(axis=1) + onto.normal_weight**2 * ((normal - normals) ** 2).sum(axis=1)
    areas = mesh.vertex_areas[some]
    return float(areas @ np.minimum(np.sqrt(square), FAR) / areas.sum())


def _crossed(arm: Floats) -> Floats:
    """Return the matrices, (n, 3, 3), that carry a rotation vector to its cross product with each arm, (n, 3)."""
    return np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)
