"""The kernels in numpy: the specification, the fallback, and what the compiled ones are tested against."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ...surface.mesh import Complexes, Floats
from ..bounds import Arcs, common_rotation, enclosing_arcs, exact_arcs
from ..matching import Matching, nothing
from ..stabbing import envelope, swept
from ..watch import Halt, Halted, look
from .nodes import BOUND, HALF, WIDTH, X, Y, new_nodes

CELLS_AT_ONCE = 64
"""Cells bounded in one go: enough to keep numpy busy, few enough to keep its arrays small."""

MOST_AT_ONCE = 1 << 19
"""Cells times pairs in one go."""


def bound_cells(problem: Matching, centre: Complexes, half: Floats, check: Callable[[], None] = nothing) -> Floats:
    """Return, for each square cell of z, (C,), a number that Q does not exceed at any z in it and any theta."""
    bounds = np.zeros(len(centre))
    for some in cuts(problem, len(centre)):
        kappa = common_rotation(problem.source, centre[some], np.zeros(len(centre[some]), np.complex128))
        arcs = partial(enclosing_arcs, centre=centre[some], half=half[some], kappa=kappa)
        bounds[some] = stabbed(problem, arcs, len(kappa), check)[0]
    return bounds


def best_rotations(problem: Matching, z: Complexes, check: Callable[[], None] = nothing) -> tuple[Floats, Floats]:
    """Return U(z) = max over theta of Q, and such a theta in radians, for each z, (C,); to rounding error."""
    values, rotations = np.zeros(len(z)), np.zeros(len(z))
    for some in cuts(problem, len(z)):
        values[some], rotations[some] = stabbed(problem, partial(exact_arcs, z=z[some]), len(z[some]), check)
    return values, rotations


def cuts(problem: Matching, count: int) -> list[slice]:
    """Cut `count` cells into as many as are looked at in one go."""
    step = int(np.clip(MOST_AT_ONCE // max(problem.count, 1), 1, CELLS_AT_ONCE))
    return [slice(first, first + step) for first in range(0, count, step)]


def stabbed(
    problem: Matching, arcs: Callable[[Matching], Arcs], rows: int, check: Callable[[], None]
) -> tuple[Floats, Floats]:
    """Sweep over the arcs of all pairs, which are laid out some source points at a time."""
    steps, points = [], len(problem.source)
    for first, last in problem.blocks():
        check()
        part = problem.part(first, last)
        row, pair, middle, half_width = arcs(part)
        steps.append(envelope(row, part.point[pair] + first, middle, half_width, part.weight[pair], points))
    check()
    owner, theta, rise = (np.concatenate(x) for x in zip(*steps, strict=True))
    return swept(owner, theta, rise, rows, points)


class ReferenceKernels:
    """The kernels for one matching, in numpy; see `CompiledKernels` for the same in C."""

    name = "numpy"

    def __init__(
        self,
        problem: Matching,
        z_max: float,
        smallest: float,
        halt: Halt | None = None,
    ) -> None:
        self.problem, self.z_max, self.smallest = problem, z_max, smallest
        self.halt = np.zeros(1, np.int32) if halt is None else halt

    def reflected(self) -> ReferenceKernels:
        """Return the kernels for the conjugated source."""
        return ReferenceKernels(self.problem.reflected(), self.z_max, self.smallest, self.halt)

    def _check(self) -> None:
        look(self.halt)

    def rotations(self, z: Complexes, value: float = -1.0, windows: Floats | None = None) -> tuple[Floats, Floats]:
        """Return U(z) and a theta that attains it for each z, (C,), over all rotations; 0 if halted."""
        del value, windows
        try:
            return best_rotations(self.problem, z, self._check)
        except Halted:
            return np.zeros(len(z)), np.zeros(len(z))

    def expand(self, nodes: Floats, value: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of cells after splitting them once, and how many bounds that took; see `nodes`.

        If halted, cells are left as they were.
        """
        del budget
        half = np.repeat(nodes[:, HALF] / 2, 4)
        corner = np.tile([-1 - 1j, 1 - 1j, -1 + 1j, 1 + 1j], len(nodes))
        centre = np.repeat(nodes[:, X] + 1j * nodes[:, Y], 4) + half * corner
        nearest = np.hypot(np.maximum(np.abs(centre.real) - half, 0), np.maximum(np.abs(centre.imag) - half, 0))
        reaching = nearest <= self.z_max * (1 + 2.0**-50)
        centre, half, parent = centre[reaching], half[reaching], np.repeat(nodes[:, BOUND], 4)[reaching]
        try:
            bounds = np.minimum(bound_cells(self.problem, centre, half, self._check), parent)
        except Halted:
            return nodes.copy(), 0
        left = bounds > value
        children = new_nodes(int(left.sum()))
        children[:, X], children[:, Y] = centre[left].real, centre[left].imag
        children[:, HALF], children[:, BOUND], children[:, WIDTH] = half[left], bounds[left], 1
        return children, len(centre)
