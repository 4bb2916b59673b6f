"""The inner loops: in C where the library `mobius_kernels` is installed, else in numpy."""

from __future__ import annotations

from types import ModuleType

from . import compiled, reference


def inner_loops() -> ModuleType:
    """Return `compiled` where it can be used, else `reference`: both have `texels`, `sample` and `islands`."""
    return reference if compiled.library() is None else compiled
