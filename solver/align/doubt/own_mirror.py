"""The plane in which a part of a surface is its own mirror image: what a mirrored map of two halves of a thing hides.

Two scans of one symmetric thing, from its left and from its right, match mirrored as well as a scan matches itself:
each shows of one side what the other shows of the other. Without mirroring they share the middle alone. The source's
own plane of symmetry tells where the target would lie then.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from ...surface.mesh import Booleans, Floats
from ...surface.nearest import SurfacePoints
from ...surface.sampling import spread

ASKED = 500
"""Vertices, about, among which points and their mirror images are looked for."""

ALIKE = 8
"""Vertices with the descriptors most like a point's own that may be its mirror image."""

ASIDE = 0.1
"""Distance, in roots of the area, from which on two points say where the plane between them lies."""

TURNED, SHIFTED = 0.1, 0.05
"""Difference of normals, and distance in roots of the area, up to which two planes are the same one."""

PLANES = 4
"""Planes that are fitted: those with most votes, each another one than those before."""

ROUNDS = 10
"""Closest point rounds in which a plane settles."""

FAR, NEAR, ALONG = 0.04, 0.015, 0.9
"""Distances in roots of the area, and cosine between normals, within which a mirrored point lies on the surface: while
the plane is sought, and at last. Of faces of real people 0.97 of the points do, or more; where a fifth is cut off
at one side 0.66, all that are on both; of teeth and ears 0.15 to 0.45."""

LEAST = 0.4
"""Share of the points whose mirror images have to lie on the surface: of a thing that lacks 30 % at one side 4 in 7."""


def mirror_plane(onto: SurfacePoints, descriptors: Floats) -> tuple[Floats, Floats] | None:
    """Return the plane in which most of a surface mirrors itself: its normal and a point, (3,) each; None: too little.

    Two points with like descriptors, and normals that are mirrored, vote for the plane between them; the planes with
    most votes are fitted to the surface and its mirror image.

    Parameters
    ----------
    onto : SurfacePoints
        The surface, of about unit area.
    descriptors : (n, d) float64
        Of its vertices, the same on a mirror image.
    """
    mesh = onto.mesh
    used = np.flatnonzero(mesh.used)
    some = used[spread(mesh.vertices[used], ASKED)] if len(used) > ASKED else used
    points, normals = mesh.vertices[some], mesh.vertex_normals()[some]
    _, found = KDTree(descriptors[some]).query(descriptors[some], k=min(ALIKE + 1, len(some)))
    like = np.asarray(found, np.intp).reshape(len(some), -1)[:, 1:]
    here, there = np.repeat(np.arange(len(some)), like.shape[1]), like.ravel()
    across = points[here] - points[there]
    length = np.linalg.norm(across, axis=1)
    aside = length > ASIDE
    here, there, across = here[aside], there[aside], across[aside] / length[aside, None]
    agree = (_turned(normals[here], across) * normals[there]).sum(axis=1) > ALONG
    here, there, across = here[agree], there[agree], across[agree]
    if not len(here):
        return None
    middle = (points[here] + points[there]) / 2
    centre = points.mean(axis=0)
    # a plane as a normal, either sign, and its distance from the centre along it
    offset = ((middle - centre) * across).sum(axis=1)
    planes = np.concatenate([across / TURNED, offset[:, None] / SHIFTED], axis=1)
    both = KDTree(np.concatenate([planes, -planes]))
    votes = np.asarray(both.query_ball_point(planes, 1.0, return_length=True), np.intp)
    best, most = None, LEAST
    for _ in range(PLANES):
        first = int(np.argmax(votes))
        if votes[first] == 0:
            break
        normal, at = _settled(onto, points, normals, across[first], middle[first])
        image = mirrored(points, normal, at)
        share = _lying(onto, image, normals - 2 * (normals @ normal)[:, None] * normal, NEAR)[1].mean()
        if share > most:
            best, most = (normal, at), share
        apart = np.minimum(
            np.linalg.norm(planes - planes[first], axis=1), np.linalg.norm(planes + planes[first], axis=1)
        )
        votes[apart < 2] = 0
    return best


def mirrored(points: Floats, normal: Floats, middle: Floats) -> Floats:
    """Return points, (n, 3), mirrored in a plane."""
    return points - 2 * ((points - middle) @ normal)[:, None] * normal


def _turned(normals: Floats, across: Floats) -> Floats:
    return normals - 2 * (normals * across).sum(axis=1)[:, None] * across


def _lying(onto: SurfacePoints, points: Floats, normals: Floats, near: float) -> tuple[Floats, Booleans]:
    """Return the nearest points of a surface, (q, 3), and which points lie so near, and as it faces there, (q,)."""
    face, barycentric = onto.nearest_point(points, normals)
    corners = onto.mesh.faces[face]
    other = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[corners])
    facing = np.einsum("qk,qkd->qd", barycentric, onto.normals[corners])
    return other, (np.linalg.norm(other - points, axis=1) < near) & ((facing * normals).sum(axis=1) > ALONG)


def _settled(
    onto: SurfacePoints, points: Floats, normals: Floats, normal: Floats, middle: Floats
) -> tuple[Floats, Floats]:
    """Return the plane fitted to points of a surface and the nearest ones to their mirror images."""
    for _ in range(ROUNDS):
        image = mirrored(points, normal, middle)
        other, lies = _lying(onto, image, normals - 2 * (normals @ normal)[:, None] * normal, FAR)
        if lies.sum() < 4:
            break
        # least squares of where mirrored points miss theirs: beside each other, and off the plane, which counts twice
        across, between = (points - other)[lies], ((points + other) / 2)[lies]
        middle = between.mean(axis=0)
        arm = between - middle
        normal = np.linalg.eigh(across.T @ across - 4 * arm.T @ arm)[1][:, -1]
    return normal, middle
