"""Going over a surface from face to face, so that one never comes to what is near in space alone, as the other lip."""

from __future__ import annotations

import numpy as np

from .barycentric import weighted
from .mesh import Floats, Integers, TriangleMesh, directed_edges, edges_of_sides, twin_sides
from .nearest import nearest_in_triangle

STEPS = 4096
"""Of one walk at most, over a source of any size that one triangle of the target may span."""


def faces_beyond(mesh: TriangleMesh) -> Integers:
    """Return the face across the side opposite each corner, (f, 3); -1: none.

    Across cuts too, where two sides of a boundary lie in one place and no third does: files cut surfaces open along the
    seams of their layouts.
    """
    faces, count = mesh.faces, len(mesh.vertices)
    twin = twin_sides(edges_of_sides(faces, count)[1])
    rim = np.flatnonzero(twin < 0)
    if len(rim):
        _, same = np.unique(mesh.vertices, axis=0, return_inverse=True)
        edges = np.sort(same.reshape(-1)[directed_edges(faces)[rim]], axis=1)
        across = twin_sides(np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1))
        twin[rim] = np.where(across >= 0, rim[across], -1)
    return np.where(twin >= 0, twin // 3, -1).reshape(-1, 3)


def nearest_from(
    mesh: TriangleMesh, beyond: Integers, starts: Integers, points: Floats
) -> tuple[Integers, Floats, Floats]:
    """Return the nearest place to points, (q, d), that is found going from faces, (q, k), to ever nearer ones.

    Among their neighbours, and those of these.

    Parameters
    ----------
    mesh : TriangleMesh
    beyond : (f, 3) int
        See `faces_beyond`.
    starts : (q, k) int
        Of the ends of these walks the nearest is taken.
    points : (q, 3) float64

    Returns
    -------
    (q,) int, (q, 3) float64, (q,) float64
        The face, barycentric coordinates in it, and how far off that is.
    """
    corners = mesh.vertices[mesh.faces]
    face, place, best = starts[:, 0].copy(), np.zeros((len(points), 3)), np.full(len(points), np.inf)

    def apart(faces: Integers, rows: Integers) -> tuple[Floats, Floats]:
        weights = nearest_in_triangle(points[rows], corners[faces])
        off = weighted(corners[faces], weights) - points[rows]
        return weights, (off**2).sum(axis=1)

    for start in starts.T:
        rows, here = np.arange(len(points)), start.copy()
        weights, square = apart(here, rows)
        for _ in range(STEPS):
            around = beyond[here[rows]]
            further = beyond[around].reshape(len(rows), 9)
            further[np.repeat(around < 0, 3, axis=1)] = -1
            before = here[rows]
            for column in np.hstack([around, further]).T:
                there = np.flatnonzero(column >= 0)
                found, its = apart(column[there], rows[there])
                nearer = its < square[rows[there]]
                at = rows[there[nearer]]
                here[at], square[at], weights[at] = column[there[nearer]], its[nearer], found[nearer]
            rows = rows[here[rows] != before]
            if len(rows) == 0:
                break
        nearer = square < best
        face[nearer], place[nearer], best[nearer] = here[nearer], weights[nearer], square[nearer]
    return face, place, np.sqrt(best)
