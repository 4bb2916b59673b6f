"""The inner loops of the search: in C where the library `mobius_kernels` is installed, else in numpy.

`kernels.c` is compiled by `build_wheel.py` into the wheel `mobius_kernels`; `compiled` calls it, `reference` is the
same in numpy.
"""

from __future__ import annotations

from ..matching import Matching
from .compiled import CompiledKernels, library
from .reference import ReferenceKernels

__all__ = ["CompiledKernels", "ReferenceKernels", "kernels_for"]


def kernels_for(problem: Matching, z_max: float, smallest: float) -> CompiledKernels | ReferenceKernels:
    """Return the fastest kernels there are for a matching, for |z| <= z_max and cells of half side >= smallest."""
    return (ReferenceKernels if library() is None else CompiledKernels)(problem, z_max, smallest)
