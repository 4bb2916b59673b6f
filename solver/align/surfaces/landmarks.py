"""Pairs of points that the user knows, as weights in the same search: bad ones are outvoted like any other point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...flatten.sphere import Flat
from ...surface.mesh import Booleans, Floats, Integers, Places, plural
from ...surface.tidy import Cleaned
from .remark import Remark

REACH = 0.1
"""Pseudo-hyperbolic radius within which a landmark counts as hit: twice what Möbius maps of scans err by, 0.03 roots of
the area or 0.05 in the middle of the disc."""


def own_landmarks(pairs: npt.ArrayLike | None, source: Cleaned, target: Cleaned) -> Integers | None:
    """Return (source vertex, target vertex) rows, (l, 2), of the meshes as they came as vertices of those in order.

    Raises
    ------
    ValueError
        Not of shape (l, 2), not whole numbers, or no vertices of these meshes.
    """
    if pairs is None or np.size(pairs) == 0:
        return None
    given = np.asarray(pairs)
    if given.ndim != 2 or given.shape[1] != 2 or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(f"landmarks must be whole numbers of shape (l, 2), not {given.dtype} of shape {given.shape}")
    for column, tidy in zip(given.T, (source, target), strict=True):
        if column.min() < 0 or column.max() >= tidy.size:
            raise ValueError(
                f"landmarks name vertices outside 0 to {tidy.size - 1} of '{tidy.mesh.name}' (the first is row "
                f"{int(np.argmax((column < 0) | (column >= tidy.size)))})"
            )
    columns = [tidy.vertices_for(column) for column, tidy in zip(given.T, (source, target), strict=True)]
    return np.stack(columns, axis=1).astype(np.intp)


def usable_landmarks(given: Integers | None, source: Flat, target: Flat) -> tuple[Integers, list[Remark]]:
    """Return the (source vertex, target vertex) rows that can be used, (l, 2), and what is to be said of the others."""
    if given is None or given.size == 0:
        return np.empty((0, 2), np.intp), []
    # nan compares false, so loose vertices drop out here too
    inside = _inside(source, given[:, 0]) & _inside(target, given[:, 1])
    left_out = int((~inside).sum())
    said = f"{plural(left_out, 'landmark')} on a boundary or in no face left out"
    return given[inside], [Remark("landmarks", said)] if left_out else []


def _inside(surface: Flat, vertices: Integers) -> Booleans:
    """Return which vertices are in use and on no outer boundary."""
    if surface.domain.closed:
        return surface.mesh.used[vertices]
    return np.abs(surface.places[vertices]) < 1 - 1e-9


def with_landmarks(
    pairs: Integers, source: Places, target: Places, radius: Floats, weights: Floats
) -> tuple[Integers, Floats, Floats]:
    """Return the rows of `pairs` that join the source's points, (c,), and radii and weights with the landmarks in them.

    The target's points are followed by one for each landmark. Together the landmarks weigh half as much as the other
    source points: each joins as often as it takes.

    Parameters
    ----------
    pairs : (l, 2) int
    source, target : (N1,), (N2,) complex128
        The other points.
    radius, weights : (N2,), (N1, N2) float64
    """
    copies = max(1, round(len(source) / (2 * len(pairs))))
    rows = np.repeat(np.arange(len(pairs)), copies)
    table = np.zeros((len(source) + len(rows), len(target) + len(pairs)))
    table[: len(source), : len(target)] = weights
    table[len(source) + np.arange(len(rows)), len(target) + rows] = 1
    return rows, np.concatenate([radius, np.full(len(pairs), REACH)]), table
