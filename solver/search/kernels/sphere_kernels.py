"""The kernels of the search on the sphere: those of the disc, compiled for caps, and in numpy."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ...surface.mesh import Floats, Integers
from ..matching import Matching
from ..sphere_bounds import caps, enclosing_arcs
from ..watch import Halt, Halted, look
from .compiled import _POINTER, CompiledKernels, _Problem, library
from .nodes import BOUND, FROM, HALF, WIDTH, X, Y
from .reference import cuts, stabbed
from .sphere_nodes import new_sphere_nodes


class _SphereProblem(_Problem):
    _fields_ = [("mz", _POINTER), ("caps", _POINTER)]  # noqa: RUF012


class CompiledSphereKernels(CompiledKernels):
    """The kernels for one matching, in C; see `SphereReferenceKernels` for the same in numpy."""

    prefix = "sphere"
    structure = _SphereProblem

    def __init__(self, problem: Matching, smallest: float, halt: Halt | None = None) -> None:
        super().__init__(problem, 0.0, smallest, halt)

    def _source(self, problem: Any) -> dict[str, np.ndarray | None]:
        return dict(zip(("mx", "my", "mz"), problem.source.T, strict=True))

    def _discs(self, problem: Any) -> tuple[Floats, Floats]:
        return caps(problem.centres, problem.radii), np.clip(0.5 * (1 - problem.centres[:, 2]), 0, 1)

    def _places(self, problem: Any, row: Integers) -> dict[str, np.ndarray | None]:
        rho = problem.radii[row]
        sine = rho * np.sqrt(np.maximum(1 - rho**2 / 4, 0))
        return {"caps": np.column_stack([problem.centres[row], 1 - rho**2 / 2, sine])}

    def _rows(self, count: int) -> Floats:
        return new_sphere_nodes(count)

    def _centres(self, z: Any) -> tuple[np.ndarray, ...]:
        return (np.ascontiguousarray(z),)

    def images_of(self, node: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return `sphere_bounds.images` of one cell, angles in turns."""
        alpha, delta, near, far = np.zeros((4, self.points))
        row, problem = np.ascontiguousarray(node, np.float64), self._problem
        addresses = [x.ctypes.data for x in (row, alpha, delta, near, far)]
        self._library.sphere_images_of(self.points, problem.mx, problem.my, problem.mz, *addresses)
        return alpha, delta, near, far


def bound_sphere_cells(problem: Matching, nodes: Floats, check: Any = lambda: None) -> tuple[Floats, Floats]:
    """Return, for each cell, (C, 9), what Q does not exceed in it, whatever the angle, and a good angle, radians."""
    bounds, angles = np.zeros(len(nodes)), np.zeros(len(nodes))
    for some in cuts(problem, len(nodes)):
        arcs = partial(enclosing_arcs, nodes=nodes[some])
        bounds[some], angles[some] = stabbed(problem, arcs, len(nodes[some]), check)
    return bounds, angles


class SphereReferenceKernels:
    """The kernels for one matching, in numpy."""

    name = "numpy"

    def __init__(self, problem: Matching, smallest: float, halt: Halt | None = None) -> None:
        self.problem, self.smallest = problem, smallest
        self.halt = np.zeros(1, np.int32) if halt is None else halt

    def reflected(self) -> SphereReferenceKernels:
        """Return the kernels for the conjugated source."""
        return SphereReferenceKernels(self.problem.reflected(), self.smallest, self.halt)

    def _check(self) -> None:
        look(self.halt)

    def rotations(self, z: Floats, value: float = -1.0, windows: Floats | None = None) -> tuple[Floats, Floats]:
        """Return what the best angle is worth at the middle of each cell, (C, 9), and that angle; 0 if halted."""
        del value, windows
        middles = z.copy()
        middles[:, HALF] = 0
        try:
            return bound_sphere_cells(self.problem, middles, self._check)
        except Halted:
            return np.zeros(len(z)), np.zeros(len(z))

    def expand(self, nodes: Floats, value: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of cells after splitting them once, and how many bounds that took.

        If halted, cells are left as they were.
        """
        del budget
        new = children(nodes)
        try:
            bounds = np.minimum(bound_sphere_cells(self.problem, new, self._check)[0], new[:, BOUND])
        except Halted:
            return nodes.copy(), 0
        new[:, BOUND] = bounds
        return new[bounds > value], len(new)


def children(nodes: Floats) -> Floats:
    """Return the four cells that each cell is split into, with all rotations and their bounds."""
    new = np.repeat(nodes, 4, axis=0)
    new[:, HALF] /= 2
    new[:, [X, Y]] += new[:, [HALF]] * np.tile([[-1.0, -1], [1, -1], [-1, 1], [1, 1]], (len(nodes), 1))
    new[:, FROM], new[:, WIDTH] = 0, 1
    return new


def sphere_kernels_for(
    problem: Matching, smallest: float, most_points: int, halt: Halt | None = None
) -> CompiledSphereKernels | SphereReferenceKernels:
    """Return the fastest kernels there are for a matching; see `kernels_for`."""
    compiled = len(problem.source) < most_points and library() is not None
    return (CompiledSphereKernels if compiled else SphereReferenceKernels)(problem, smallest, halt)
