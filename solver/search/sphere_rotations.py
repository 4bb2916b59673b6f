"""The best rotation of the sphere, by branch and bound over the axis, with the angle about it found exactly for each.

As in the disc: the axis, a point of the sphere, is what z is there, the angle is stabbed (`sphere_bounds`).
"""

from __future__ import annotations

import numpy as np

from ..mobius import SphereMobius
from ..surface.mesh import Floats
from .frontier import CENTRES, NEAR, SMALLEST_CELL, Search
from .kernels import MOST_POINTS
from .kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y
from .kernels.sphere_kernels import sphere_kernels_for
from .kernels.sphere_nodes import whole_sphere
from .sphere_bounds import transformation
from .sphere_matching import SphereMatching

LAST_STEP = 1e-4
"""Of a climb, in radians."""


def never(value: float, bound: float, nodes: int) -> bool:
    """Return False: the search is not ended before all is proved."""
    del value, bound, nodes
    return False


class Rotations(Search):
    """The state of the search of rotations alone."""

    identity = SphereMobius()

    def begin(self, plain: SphereMatching, reflect: bool) -> None:
        """Set up what the search needs."""
        self.sides = [plain, plain.reflected()] if reflect else [plain]
        self.unlooked = plain.limit
        self.value, self.matches = plain.evaluated(self.best, self.check)
        self.kernels = [sphere_kernels_for(plain, SMALLEST_CELL, MOST_POINTS, self.halt)]
        if reflect:
            self.kernels.append(self.kernels[0].reflected())
        self.frontier = [whole_sphere(problem.limit) for problem in self.sides]
        self.unlooked = -np.inf

    def _improve(self, side: int, left: Floats) -> None:
        """Look for a better transformation in the middle of the most promising cells, then around the best of them."""
        inside = left[np.argsort(-left[:, BOUND], kind="stable")[:CENTRES]]
        if len(inside) == 0:
            return
        values, angles = self.kernels[side].rotations(inside, self.value, inside[:, [FROM, WIDTH]])
        k = int(np.argmax(values))
        if values[k] > self.value:
            cell = inside[k]
            self._climb(side, cell, float(angles[k]), float(values[k]), float(cell[HALF]))

    def _climb(self, side: int, cell: Floats, phi: float, value: float, step: float) -> None:
        """Climb from a cell's middle by a pattern search: the value is a step function, so there is no slope."""
        here = cell.copy()
        here[HALF] = 0
        ring = np.exp(2j * np.pi * np.arange(8) / 8)
        while step > LAST_STEP:
            self.check()
            around = np.repeat(here[None], len(ring), axis=0)
            scale = np.sqrt(1 + here[X] ** 2 + here[Y] ** 2)
            around[:, X] += step * scale * ring.real
            around[:, Y] += step * scale * ring.imag
            near = np.tile([phi / (2 * np.pi) - 0.5 * NEAR, NEAR], (len(around), 1))
            values, angles = self.kernels[side].rotations(around, value, near)
            k = int(np.argmax(values))
            if values[k] > value:
                here, value, phi = around[k], float(values[k]), float(angles[k])
            else:
                step /= 2
        self._offer(side, transformation(here, phi))

    def _offer(self, side: int, found: SphereMobius) -> None:
        """Take a rotation if it is better."""
        value, matches = self.sides[side].evaluated(found, self.check)
        if value > self.value:
            self.value, self.matches, self.best_side = value, matches, side
            self.best = SphereMobius(rotation=found.rotation, reflected=side == 1)
