"""How carried values join those that are there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.surface.mesh import Floats
from .carrier import Values
from .plan import Carried


def over(carried: Carried, there: Values) -> Carried:
    """Return a layer that has, where nothing is carried, the values of the one that it will stand beside."""
    values = np.where(carried.covered.reshape(-1, *[1] * (there.ndim - 1)), carried.values, there)
    return replace(carried, values=values, covered=np.ones(len(values), bool))


def mixed(values: Values, there: Values | None, mix: str, share: Floats) -> Values:
    """Return what is there and the carried values joined, going the share, (n,), of the way; missing ones are 0."""
    if mix == "replace" and (share == 1).all():
        return values
    old = np.zeros(values.shape) if there is None else np.nan_to_num(there.astype(np.float64), posinf=0, neginf=0)
    joined = {"replace": values, "add": old + values, "subtract": old - values, "multiply": old * values}[mix]
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.where(share == 1, joined, old + share * (joined - old))


def changes(carried: Carried, there: Values | None) -> bool:
    """Return whether writing a layer would change what is there; what is missing counts as zeros."""
    new = carried.values[carried.covered]
    if there is None:
        return bool(new.any())
    return bool((new.astype(there.dtype) != there[carried.covered]).any())
