"""Points in order on the unit circle, and how much of a rim numbers cannot tell apart there."""

from __future__ import annotations

import numpy as np

from ..surface.mesh import Complexes, Floats, Integers, TriangleMesh


def smallest_arc(count: int) -> float:
    """Return the shortest arc in radians that `count` points may leave between two of them.

    Less, and the triangles at the circle drown in rounding.
    """
    return min(1e-7, 0.02 * np.pi / count)


def angles_of_arcs(arcs: Floats) -> Floats:
    """Return the angles in radians at which consecutive arcs, (k,), begin, from 0, scaled to the full circle.

    Arcs below the smallest are raised to it first.
    """
    arcs = np.maximum(arcs * (2 * np.pi / arcs.sum()), smallest_arc(len(arcs)))
    return 2 * np.pi * np.concatenate([[0], np.cumsum(arcs[:-1])]) / arcs.sum()


def on_circle(points: Complexes) -> Complexes:
    """Return points, (k,), that all but lie in order on the unit circle, strictly so."""
    points = points / np.abs(points)
    arcs = np.angle(np.roll(points, -1) / points)
    if arcs.sum() < np.pi:  # one arc is longer than half the circle
        arcs[np.argmin(arcs)] += 2 * np.pi
    if arcs.min() >= 0.5 * smallest_arc(len(arcs)):
        return points
    return points[0] * np.exp(1j * angles_of_arcs(np.maximum(arcs, 0)))


def lost_rim(mesh: TriangleMesh, disc: Complexes, boundary: Integers) -> float:
    """Return the share of the rim's length, in [0, 1], the arcs of which are no longer than numbers force them to be.

    There the map is not conformal: the true arcs are shorter, as at the ends of a long band.
    """
    ahead = np.roll(boundary, -1)
    arcs = np.abs(disc[ahead] - disc[boundary])
    length = np.sqrt(((mesh.vertices[ahead] - mesh.vertices[boundary]) ** 2).sum(axis=1))
    return float(length[arcs <= 2 * smallest_arc(len(boundary))].sum() / length.sum())
