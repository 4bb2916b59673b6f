"""Values that are no finite numbers count as missing: they are neither mixed into others nor written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.carry.fill import nearest_known
from ...solver.surface.mesh import Booleans, plural
from .carrier import Carrier, Values
from .table import NOUNS, Row

_ELEMENTS = {"POINT": "vertex", "EDGE": "edge", "FACE": "face", "CORNER": "face corner"}


def finite_rows(values: Values) -> Booleans:
    """Return which rows of values, (n, ...), are finite in Blender's single precision; texts and integers are."""
    if values.dtype.kind != "f":
        return np.ones(len(values), bool)
    with np.errstate(over="ignore"):
        return np.isfinite(values.astype(np.float32)).reshape(len(values), -1).all(axis=1)


def carried_without_missing(row: Row, carrier: Carrier, values: Values) -> tuple[Values, Booleans, int]:
    """Return what `row.carry` does of the values that are numbers, and how many elements of the source are none.

    What comes from an element without a number has no value; beside it, the nearest one stands in for it.
    """
    good = finite_rows(values)
    if good.all():
        carried, covered = row.carry(carrier, values)
    else:
        carried, covered = row.carry(carrier, _completed(row.access.domain, carrier, values, good))
        # as `carrier` would carry a mark, whatever it does with gaps
        marks = {
            "POINT": Carrier.nearest_points,
            "EDGE": Carrier.edges,
            "FACE": Carrier.faces,
            "CORNER": Carrier.nearest_corners,
        }[row.access.domain]
        covered = covered & ~marks(replace(carrier, gap="leave"), ~good)[0]
    return carried, covered & finite_rows(carried), int((~good).sum())


def missing_warning(row: Row, name: str, source: str, count: int) -> str:
    """Return the sentence for a layer with elements whose values are no numbers."""
    number = plural(count, _ELEMENTS[row.access.domain])
    return f"'{name}' of the {NOUNS[row.kind]} of '{source}' is no finite number at {number}: that is left out"


def _completed(domain: str, carrier: Carrier, values: Values, good: Booleans) -> Values:
    """Return the values with the nearest good one in place of each that is none, 0 where there is no such."""
    origin = np.where(good, np.arange(len(good)), -1)
    if domain == "POINT":
        origin = nearest_known(carrier.source.mesh, good)
    elif domain == "CORNER":
        vertex = carrier.source.corner_vertex
        at_vertex = np.full(len(carrier.source.mesh.vertices), -1)
        at_vertex[vertex[good]] = np.flatnonzero(good)
        origin = np.where(good, origin, at_vertex[vertex])
    result = values[origin]
    result[origin < 0] = 0
    return result
