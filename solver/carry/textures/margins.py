"""The margin around islands, which filtering and smaller copies of a picture read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...surface.mesh import Booleans, Integers
from .picture import Pixels

_AROUND = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))


@dataclass(frozen=True, eq=False)
class Margin:
    """Texels around the islands, and for each the texel of an island that it repeats.

    Attributes
    ----------
    texel, origin : (k,) int
        Numbers of texels, row by row.
    """

    texel: Integers
    origin: Integers

    @staticmethod
    def of(covered: Booleans, width: int) -> Margin:
        """Find the texels up to a width away from those covered, (rows, columns), nearest first.

        Step by step to the four and to the eight neighbours in turn, so that the margin is an octagon's.
        """
        rows, columns = covered.shape
        taken = covered.copy()
        flat = taken.reshape(-1)
        bare = np.zeros_like(covered)
        bare[1:] |= ~covered[:-1]
        bare[:-1] |= ~covered[1:]
        bare[:, 1:] |= ~covered[:, :-1]
        bare[:, :-1] |= ~covered[:, 1:]
        front = np.flatnonzero(covered & bare)
        source = front
        texels, origins = [], []
        for step in range(width):
            y, x = np.divmod(front, columns)
            found, whence = [], []
            for dy, dx in _AROUND[: 8 if step % 2 else 4]:
                within = (y + dy >= 0) & (y + dy < rows) & (x + dx >= 0) & (x + dx < columns)
                there = front[within] + dy * columns + dx
                free = ~flat[there]
                there, its = there[free], source[within][free]
                there, once = np.unique(there, return_index=True)
                flat[there] = True
                found.append(there)
                whence.append(its[once])
            front, source = np.concatenate(found), np.concatenate(whence)
            if len(front) == 0:
                break
            texels.append(front)
            origins.append(source)
        none = np.zeros(0, np.intp)
        return Margin(np.concatenate([none, *texels]), np.concatenate([none, *origins]))

    def fill(self, pixels: Pixels) -> None:
        """Fill the margin of a picture, (rows, columns, channels), in place."""
        flat = pixels.reshape(-1, pixels.shape[2])
        flat[self.texel] = flat[self.origin]
