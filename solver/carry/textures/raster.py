"""Which texels a triangle of a layout touches, and where in it they lie: in numpy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...surface.mesh import Floats, Integers

DEPTH = 0.01
"""Islands, or triangles, that overlap by less, in texels, only touch: the rounding of float32 UVs in 8192 texels."""

CANDIDATES = 1 << 19
"""Texels looked at in one go."""


def touched(layout: Floats, first: int, rows: int, width: int) -> Any:
    """Yield triangles, the texels x and y that they touch, barycentric coordinates, and whether the middle is inside.

    And by how much each coordinate rises within `DEPTH`.
    """
    low = np.ceil(layout.min(axis=1) - 0.5).astype(np.intp)
    high = np.floor(layout.max(axis=1) + 0.5).astype(np.intp)
    low = np.maximum(low, [0, first])
    high = np.minimum(high, [width - 1, first + rows - 1])
    sides = layout[:, [1, 2, 0]] - layout[:, [2, 0, 1]]
    area = sides[:, 1, 0] * sides[:, 2, 1] - sides[:, 1, 1] * sides[:, 2, 0]
    extent = np.where((np.abs(area) > 1e-12)[:, None], np.maximum(high - low + 1, 0), 0)
    count = extent.prod(axis=1)
    order = np.flatnonzero(count)
    piece = np.cumsum(count[order]) // CANDIDATES
    for some in np.split(order, np.flatnonzero(np.diff(piece)) + 1):
        triangle = np.repeat(some, count[some])
        if len(triangle) == 0:
            continue
        number = np.arange(len(triangle)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
        row, column = np.divmod(number, extent[triangle, 0])
        x, y = low[triangle, 0] + column, low[triangle, 1] + row
        weights, slope = coordinates(layout[some], area[some])
        local = np.repeat(np.arange(len(some)), count[some])
        value = weights[local, :, 0] + weights[local, :, 1] * x[:, None] + weights[local, :, 2] * y[:, None]
        reach = 0.5 * np.abs(weights[:, :, 1:]).sum(axis=2)
        touched = np.flatnonzero((value >= -reach[local]).all(axis=1))
        inside = (value[touched] >= 0).all(axis=1)
        depth = DEPTH * slope[local[touched]]
        yield triangle[touched], x[touched], y[touched], value[touched], inside, depth


def coordinates(corners: Floats, area: Floats) -> tuple[Floats, Floats]:
    """Return barycentric coordinates as constant, factor of x and factor of y, (m, 3, 3), and their slope, (m, 3)."""
    x, y = corners[:, :, 0], corners[:, :, 1]
    i, j = [1, 2, 0], [2, 0, 1]
    result = np.stack([x[:, i] * y[:, j] - x[:, j] * y[:, i], y[:, i] - y[:, j], x[:, j] - x[:, i]], axis=2)
    result /= area[:, None, None]
    return result, np.hypot(result[:, :, 1], result[:, :, 2])


def nearest(corners: Floats, x: Integers, y: Integers) -> tuple[Floats, Floats]:
    """Return coordinates of the nearest point of each triangle's edges, (q, 3), and the squared distance, (q,)."""
    best, weights = np.full(len(x), np.inf), np.zeros((len(x), 3))
    point = np.stack([x, y], axis=1)
    for k in range(3):
        j = (k + 1) % 3
        side = corners[:, j] - corners[:, k]
        length = (side**2).sum(axis=1)
        along = ((point - corners[:, k]) * side).sum(axis=1)
        along = np.clip(np.divide(along, length, out=np.zeros(len(x)), where=length > 0), 0, 1)
        square = ((corners[:, k] + along[:, None] * side - point) ** 2).sum(axis=1)
        nearer = square < best
        best[nearer] = square[nearer]
        weights[nearer, k], weights[nearer, j], weights[nearer, k - 1] = 1 - along[nearer], along[nearer], 0
    return weights, best
