"""Carried weights of all vertex groups together: small ones left out, the number limited, their sum made 1."""

from __future__ import annotations

import numpy as np

from ...solver.surface.mesh import Booleans, Floats


def tidied(
    weights: Floats, receives: Booleans, *, smallest: float, limit: int, normalize: bool, locked: Floats | None = None
) -> Floats:
    """Return weights, (n, k), as they are to be written; rows that do not receive, (n,), as they are.

    Parameters
    ----------
    weights : (n, k) float64
        A column per vertex group.
    receives : (n,) bool
        Rows that the transfer changes.
    smallest : float
        Smaller weights become 0.
    limit : int
        At most so many weights of a row stay, the greatest; 0: all.
    normalize : bool
        Scale each row to the sum 1 less its locked weight; rows without any weight stay.
    locked : (n,) float64, optional
        Sum of the weights that may not change.
    """
    result = np.where(weights < smallest, 0.0, weights)
    if 0 < limit < result.shape[1]:
        surplus = np.argsort(-result, axis=1, kind="stable")[:, limit:]
        np.put_along_axis(result, surplus, 0.0, axis=1)
    if normalize:
        total = result.sum(axis=1)
        free = np.clip(1 - (0 if locked is None else locked), 0, 1)
        result *= np.divide(free, total, out=np.ones_like(total), where=total > 0)[:, None]
    return np.where(receives[:, None], result, weights)
