"""The rows that search and kernels pass to each other on the sphere: a box of matrices, and what it can hold."""

from __future__ import annotations

import numpy as np

from ...surface.mesh import Floats, Integers

FACE, LARGEST, BOUND = 12, 13, 14
"""Columns: which coefficient is 1, the largest half side, a bound on Q."""

COLUMNS = 15

MIDDLE, SIDES = slice(0, 6), slice(6, 12)
"""Columns: middle and half sides, real and imaginary parts of the coefficients that are not 1, in their order."""

FREE = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
"""These coefficients, for each face."""


def new_boxes(count: int) -> Floats:
    """Return rows of zeros, (count, 15)."""
    return np.zeros((count, COLUMNS))


def turning(face: Integers) -> np.ndarray:
    """Return which sides of boxes, (n, 6), turn the sphere; the others are 0 in rotations."""
    other = (face[:, None] > 0) & (FREE[face] > 0)
    return np.stack([other, ~other], axis=2).reshape(-1, 6)


def whole_group(bound: float, width: int = COLUMNS) -> Floats:
    """Return the four rows that hold every transformation, (4, width)."""
    boxes = np.zeros((4, width))
    boxes[:, SIDES], boxes[:, FACE], boxes[:, LARGEST], boxes[:, BOUND] = 1, range(4), 1, bound
    return boxes


def coefficients(boxes: Floats) -> np.ndarray:
    """Return the matrices in the middle of boxes, as coefficients of 1 and Pauli's matrices, (n, 4) complex."""
    face = boxes[:, FACE].astype(np.intp)
    a = np.ones((len(boxes), 4), np.complex128)
    free = boxes[:, 0:6:2] + 1j * boxes[:, 1:6:2]
    np.put_along_axis(a, FREE[face], free, axis=1)
    return a


def points(a: np.ndarray) -> Floats:
    """Return boxes without extent about matrices, (n, 4) complex: their largest coefficient becomes 1."""
    boxes = new_boxes(len(a))
    face = np.argmax(np.abs(a), axis=1)
    free = np.take_along_axis(a, FREE[face], axis=1) / np.take_along_axis(a, face[:, None], axis=1)
    boxes[:, FACE], boxes[:, 0:6:2], boxes[:, 1:6:2] = face, free.real, free.imag
    return boxes
