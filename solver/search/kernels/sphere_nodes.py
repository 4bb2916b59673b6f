"""The rows that search and kernels pass to each other on the sphere: those of `nodes`, with what the disc has not."""

from __future__ import annotations

import numpy as np

from ...surface.mesh import Floats
from .nodes import BOUND, HALF, WIDTH

HX, HY, HZ, BALL, FACE = range(8, 13)
"""Columns: centre and half side of a cube of h, and the face of the cube that X, Y and HALF are a square of axes on."""


def new_sphere_nodes(count: int) -> Floats:
    """Return rows of zeros, (count, 13)."""
    return np.zeros((count, 13))


def whole_sphere(bound: float, h_max: float) -> Floats:
    """Return the six rows that hold every transformation with |h| <= h_max: the faces, all rotations about an axis."""
    nodes = new_sphere_nodes(6)
    nodes[:, HALF], nodes[:, WIDTH], nodes[:, BOUND], nodes[:, BALL], nodes[:, FACE] = 1, 1, bound, h_max, range(6)
    return nodes
