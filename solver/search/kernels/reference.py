"""The kernels in numpy: the specification, the fallback, and what the compiled ones are tested against."""

from __future__ import annotations

import numpy as np

from ...surface.mesh import Complexes, Floats
from ..bounds import common_rotation, enclosing_arcs, exact_arcs
from ..matching import Matching
from ..stabbing import stab
from .nodes import BOUND, HALF, WIDTH, X, Y, new_nodes

CELLS_AT_ONCE = 64
"""Cells bounded in one go: enough to keep numpy busy, few enough to keep its arrays small."""


def bound_cells(problem: Matching, centre: Complexes, half: Floats) -> Floats:
    """Return, for each square cell of z, (C,), a number that Q does not exceed at any z in it and any theta."""
    bounds = np.zeros(len(centre))
    for first in range(0, len(centre), CELLS_AT_ONCE):
        some = slice(first, first + CELLS_AT_ONCE)
        kappa = common_rotation(problem.source, centre[some], np.zeros(len(centre[some]), np.complex128))
        row, pair, middle, half_width = enclosing_arcs(problem, centre[some], half[some], kappa)
        bounds[some] = _stabbed(problem, row, pair, middle, half_width, len(kappa))[0]
    return bounds


def best_rotations(problem: Matching, z: Complexes) -> tuple[Floats, Floats]:
    """Return U(z) = max over theta of Q, and such a theta in radians, for each z, (C,); to rounding error."""
    values, rotations = np.zeros(len(z)), np.zeros(len(z))
    for first in range(0, len(z), CELLS_AT_ONCE):
        some = slice(first, first + CELLS_AT_ONCE)
        arcs = exact_arcs(problem, z[some])
        values[some], rotations[some] = _stabbed(problem, *arcs, len(z[some]))
    return values, rotations


def _stabbed(
    problem: Matching, row: np.ndarray, pair: np.ndarray, middle: Floats, half_width: Floats, rows: int
) -> tuple[Floats, Floats]:
    return stab(row, problem.point[pair], middle, half_width, problem.weight[pair], rows, len(problem.source))


class ReferenceKernels:
    """The kernels for one matching, in numpy; see `CompiledKernels` for the same in C."""

    name = "numpy"

    def __init__(self, problem: Matching, z_max: float, smallest: float) -> None:
        self.problem, self.z_max, self.smallest = problem, z_max, smallest

    def rotations(self, z: Complexes, value: float = -1.0, windows: Floats | None = None) -> tuple[Floats, Floats]:
        """Return U(z) and a theta that attains it for each z, (C,), over all rotations."""
        del value, windows
        return best_rotations(self.problem, z)

    def expand(self, nodes: Floats, value: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of cells after splitting them once, and how many bounds that took; see `nodes`."""
        del budget
        half = np.repeat(nodes[:, HALF] / 2, 4)
        corner = np.tile([-1 - 1j, 1 - 1j, -1 + 1j, 1 + 1j], len(nodes))
        centre = np.repeat(nodes[:, X] + 1j * nodes[:, Y], 4) + half * corner
        nearest = np.hypot(np.maximum(np.abs(centre.real) - half, 0), np.maximum(np.abs(centre.imag) - half, 0))
        reaching = nearest <= self.z_max * (1 + 2.0**-50)
        centre, half, parent = centre[reaching], half[reaching], np.repeat(nodes[:, BOUND], 4)[reaching]
        bounds = np.minimum(bound_cells(self.problem, centre, half), parent)
        left = bounds > value
        children = new_nodes(int(left.sum()))
        children[:, X], children[:, Y] = centre[left].real, centre[left].imag
        children[:, HALF], children[:, BOUND], children[:, WIDTH] = half[left], bounds[left], 1
        return children, len(centre)
