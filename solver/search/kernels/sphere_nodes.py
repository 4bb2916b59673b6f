"""The rows that search and kernels pass to each other on the sphere: those of `nodes`, with what the disc has not."""

from __future__ import annotations

import numpy as np

from ...surface.mesh import Floats
from .nodes import BOUND, HALF, WIDTH

FACE = 8
"""Column: the face of the cube that X, Y and HALF are a square of axes on."""


def new_sphere_nodes(count: int) -> Floats:
    """Return rows of zeros, (count, 9)."""
    return np.zeros((count, FACE + 1))


def whole_sphere(bound: float) -> Floats:
    """Return the six rows that hold every rotation: the faces, all rotations about an axis."""
    nodes = new_sphere_nodes(6)
    nodes[:, HALF], nodes[:, WIDTH], nodes[:, BOUND], nodes[:, FACE] = 1, 1, bound, range(6)
    return nodes
