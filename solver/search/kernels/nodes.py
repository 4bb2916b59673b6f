"""The rows that search and kernels pass to each other: a cell of z, a window of rotations, and what they can hold."""

from __future__ import annotations

import numpy as np

from ...surface.mesh import Floats

X, Y, HALF, KAPPA_X, KAPPA_Y, FROM, WIDTH, BOUND = range(8)
"""Columns: centre and half side of a cell, its kappa (see `bounds`), a window of rotations in turns, a bound on Q."""


def new_nodes(count: int) -> Floats:
    """Return rows of zeros, (count, 8)."""
    return np.zeros((count, 8))


def whole_disc(bound: float) -> Floats:
    """Return the one row that holds every transformation: the square around the disc, all rotations."""
    nodes = new_nodes(1)
    nodes[0, HALF], nodes[0, WIDTH], nodes[0, BOUND] = 1, 1, bound
    return nodes
