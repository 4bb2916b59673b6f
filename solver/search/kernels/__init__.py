"""The inner loops of the search: in C where the library `mobius_kernels` is installed, else in numpy.

`kernels.c` is compiled by `build_wheel.py` into the wheel `mobius_kernels`; `compiled` calls it, `reference` is the
same in numpy.
"""

from __future__ import annotations

from ..matching import Matching
from ..watch import Halt
from .compiled import CompiledKernels, library
from .reference import ReferenceKernels

MOST_POINTS = 1 << 16
"""Source points that the compiled kernels' counters of sixteen bits cannot count; more run in numpy."""

__all__ = ["CompiledKernels", "ReferenceKernels", "kernels_for"]


def kernels_for(
    problem: Matching, z_max: float, smallest: float, halt: Halt | None = None
) -> CompiledKernels | ReferenceKernels:
    """Return the fastest kernels there are for a matching, for |z| <= z_max and cells of half side >= smallest.

    Once `halt` is not 0 they come back at once, with what they have; this function raises `Halted`.
    """
    compiled = len(problem.source) < MOST_POINTS and library() is not None
    return (CompiledKernels if compiled else ReferenceKernels)(problem, z_max, smallest, halt)
