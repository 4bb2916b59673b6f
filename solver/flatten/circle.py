"""Points in order on the unit circle."""

from __future__ import annotations

import numpy as np

from ..surface.mesh import Complexes, Floats


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
