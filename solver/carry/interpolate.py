"""Values carried from the source to the target through a correspondence."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..surface.mesh import Floats, Integers
from .correspond import Correspondence


def interpolate(correspondence: Correspondence, values: npt.ArrayLike) -> Floats:
    """Return values at target vertices, (n_target, ...), linear between values at source vertices, (n_source, ...).

    0 at target vertices without a counterpart.

    Raises
    ------
    ValueError
        The number of values is not the number of source vertices.
    """
    given = np.asarray(values, dtype=np.float64)
    if len(given) != correspondence.source_size:
        raise ValueError(f"{len(given)} values do not fit a source of {correspondence.source_size} vertices")
    flat = given.reshape(len(given), -1)
    return (correspondence.matrix() @ flat).reshape((len(correspondence.face), *given.shape[1:]))


def places(correspondence: Correspondence, source_vertices: Floats) -> tuple[Integers, Floats]:
    """Return each target vertex's source triangle, (n,), and its place on the source, (n, 3)."""
    return correspondence.face, correspondence.matrix() @ source_vertices
