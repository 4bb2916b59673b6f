"""The rigid pose in which one surface lies nearest to another's tangent planes, and how well it lies there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from ..surface.barycentric import interpolated
from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.statistics import weighted_median
from ..surface.superimposing import superimposing
from .plate import planes

POSE_ROUNDS = 30
"""Closest point rounds, at most, that improve the pose before anything bends."""

POSE_SETTLED = 1e-3
"""Length, in roots of the source's area, that a round moves points by when the pose has settled."""

HELD = 0.01
"""What resists a move of the pose, as a share of springs on everything: where hardly anything is pulled, it stays."""

ROUGHLY_BY = 300
"""Vertices, about, by which a pose settles before all of them are asked."""

PROCRUSTES_ROUNDS = 20
"""Rounds of reweighting in which a rigid pose settles on the places that it can reach."""

MOST = 2000
"""Vertices that are asked for their distance, at most."""

FEW = 100
"""Vertices, about, by which poses are compared.

On 12 pairs, mirrored and not, the best of the poses that moments imply was the same by three times as many vertices
wherever it lay well.
"""

ASKED = 400
"""Vertices of either surface that say how well a pose lies, where poses are compared."""

FAR = 0.1
"""Distance, in roots of the source's area, from which on a point counts as not lying on the other surface at all."""


def in_pose(rest: TriangleMesh, onto: SurfacePoints, rounds: int = POSE_ROUNDS, most: int | None = None) -> Floats:
    """Return the vertices of `rest` in the rigid pose nearest to the source's tangent planes, after so many rounds.

    The scale stays: distances to planes fall when a surface merely shrinks. `most`: how many vertices are asked, about;
    default all.
    """
    return in_poses(rest, rest.vertices[None], onto, rounds, most)[0]


def in_poses(
    rest: TriangleMesh, starts: Floats, onto: SurfacePoints, rounds: int = POSE_ROUNDS, most: int | None = None
) -> Floats:
    """Return what `in_pose` returns for a mesh in several poses, (k, n, 3) like `starts`, asked together."""
    x = starts.copy()
    normals = np.stack([rest.moved(each).vertex_normals() for each in x])
    # from the middle outwards, so that neither pose nor order of the vertices matters
    outwards = np.argsort(((rest.vertices - rest.vertex_areas @ rest.vertices / rest.area) ** 2).sum(axis=1))
    some = outwards[:: -(-len(outwards) // (most or len(outwards)))]
    areas = rest.vertex_areas[some] / rest.vertex_areas[some].sum()
    moving = np.arange(len(x))
    for _ in range(rounds):
        here = x[moving][:, some]
        weight, normal, distance = planes(here, normals[moving][:, some], areas, onto)
        middle = areas @ here
        arm = here - middle[:, None]
        # how a shift and a turn move each vertex towards its plane, (k, n, 6)
        moves = np.concatenate([normal, np.cross(arm, normal)], axis=2)
        spread = np.swapaxes(areas[:, None] * arm, 1, 2) @ arm
        left, right = np.swapaxes(weight[..., None] * moves, 1, 2) @ moves, (weight * distance)[:, None] @ moves
        still = np.ones(len(moving), bool)
        for k, each in enumerate(moving):
            held = block_diag(np.eye(3), np.trace(spread[k]) * np.eye(3) - spread[k])
            step = np.linalg.solve(left[k] + HELD * held, right[k, 0])
            turn = Rotation.from_rotvec(step[3:])
            x[each], normals[each] = turn.apply(x[each] - middle[k]) + middle[k] + step[:3], turn.apply(normals[each])
            still[k] = np.linalg.norm(step[:3]) + np.linalg.norm(step[3:]) >= POSE_SETTLED
        moving = moving[still]
        if not len(moving):
            break
    return x


def settled(rest: TriangleMesh, onto: SurfacePoints) -> Floats:
    """Return the vertices of `rest` in the pose of `in_pose`, sooner: by `ROUGHLY_BY` of them first, then by all."""
    return in_pose(TriangleMesh(in_pose(rest, onto, most=ROUGHLY_BY), rest.faces), onto)


def rigidly(flat: TriangleMesh, places: Floats, trust: Floats) -> Floats:
    """Return the mesh, unbent, in the rigid pose that most of the places, (n, 3), agree with, by trust, (n,).

    Least squares (Kabsch 1976), reweighted by Cauchy's weights about the median distance.
    """
    base = flat.vertex_areas * trust
    weight, x = base, flat.vertices
    for _ in range(PROCRUSTES_ROUNDS):
        x = superimposing(flat.vertices, places, weight)(flat.vertices)
        distance = np.linalg.norm(x - places, axis=1)
        weight = base / (1 + (distance / max(weighted_median(distance, base), 1e-6)) ** 2)
    return x


def misfit(mesh: TriangleMesh, onto: SurfacePoints, most: int = MOST) -> float:
    """Return how badly two surfaces lie on each other: the mean distance in position and normal, either way.

    Distances count up to `FAR`; normals by the surface's own weight. `most`: how many vertices of each are asked.
    """
    return float(misfits(mesh, [(np.eye(3), np.zeros(3))], onto, most)[0])


def misfits(mesh: TriangleMesh, poses: Sequence[tuple[Floats, Floats]], onto: SurfacePoints, most: int) -> Floats:
    """Return the `misfit`, (k,), of a mesh in several poses: a rotation, (3, 3), and then a shift, (3,), each."""
    back = SurfacePoints(mesh, (), onto.normal_weight)
    there = _mean_distances(back, [(turn, shift) for turn, shift in poses], onto, most)
    return (there + _mean_distances(onto, [(turn.T, -shift @ turn) for turn, shift in poses], back, most)) / 2


def _mean_distances(
    surface: SurfacePoints, poses: Sequence[tuple[Floats, Floats]], onto: SurfacePoints, most: int
) -> Floats:
    """Return the mean distance, (k,), of a surface in each pose from another."""
    mesh = surface.mesh
    some = slice(None, None, -(-len(mesh.vertices) // most))
    points = np.concatenate([mesh.vertices[some] @ turn.T + shift for turn, shift in poses])
    normals = np.concatenate([surface.normals[some] @ turn.T for turn, _ in poses])
    face, barycentric = onto.most_alike(points, normals)
    corners = onto.mesh.faces[face]
    point = interpolated(onto.mesh.vertices, corners, barycentric)
    normal = interpolated(onto.normals, corners, barycentric)
    square = ((point - points) ** 2).sum(axis=1) + onto.normal_weight**2 * ((normal - normals) ** 2).sum(axis=1)
    areas = mesh.vertex_areas[some]
    return np.minimum(np.sqrt(square), FAR).reshape(len(poses), -1) @ areas / areas.sum()
