"""The inner loops in numpy: the specification, the fallback, and what `texels.c` is tested against."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...surface.barycentric import interpolated
from ...surface.mesh import Booleans, Floats, Integers
from ...surface.walking import STEPS, nearest_from
from .carrying import Carrying
from .raster import CANDIDATES, coordinates, nearest, touched
from .reference_sampling import islands, sample

__all__ = ["TEXEL", "islands", "sample", "texels"]

TEXEL = np.dtype(
    [
        ("triangle", np.int32),  # of the target; -1: the texel touches none
        ("face", np.int32),  # of the source; -1: no counterpart
        ("corner", np.float32, 2),  # barycentric coordinates 1 and 2 in the triangle
        ("place", np.float32, 2),  # the same in the face
        ("across", np.float32, 2),  # how these change to the next texel of a row,
        ("down", np.float32, 2),  # and to the next row
    ]
)
"""What is known of a texel, as in texels.c."""

INSIDE = 1e-9
"""How far outside a face counts as in it, in barycentric coordinates."""


def texels(carrying: Carrying, layout: Floats, first: int, rows: int, width: int) -> tuple[npt.NDArray[Any], int]:
    """Return the texels of some rows of a picture, (rows, width) TEXEL, and in how many of them triangles overlap.

    A texel belongs to the first triangle that its middle is in, else to the one it touches whose edge is nearest, and
    there to that edge's nearest point. Its `face` is -1 where a corner of the triangle has no counterpart.

    Parameters
    ----------
    carrying : Carrying
    layout : (m, 3, 2) float64
        Corners of the target's triangles in texels; the middle of the first one is (0, 0). nan: not in this picture.
    first, rows, width : int
        Which rows, and how long they are.
    """
    result = np.zeros(rows * width, TEXEL)
    result["triangle"] = result["face"] = -1
    apart = np.full(rows * width, np.inf)
    overlaps = 0
    for triangle, x, y, weights, inside, depth in touched(layout, first, rows, width):
        at = (y - first) * width + x
        square = np.zeros(len(at))
        outside = np.flatnonzero(~inside)
        weights[outside], square[outside] = nearest(layout[triangle[outside]], x[outside], y[outside])
        order = np.lexsort((triangle, square, at))
        best = order[np.unique(at[order], return_index=True)[1]]
        strict = inside & (weights > depth).all(axis=1)
        taken = apart[at] == 0
        taken[inside] |= ~np.isin(np.flatnonzero(inside), best)
        overlaps += int((strict & taken).sum())
        best = best[square[best] < apart[at[best]]]
        apart[at[best]] = square[best]
        result["triangle"][at[best]] = triangle[best]
        result["corner"][at[best]] = weights[best, 1:]
    known = carrying.known[result["triangle"]] & (result["triangle"] >= 0)
    for some in np.array_split(np.flatnonzero(known), known.sum() // CANDIDATES + 1):
        if len(some):
            _place(carrying, layout, result, some)
    return result.reshape(rows, width), overlaps


def _place(carrying: Carrying, layout: Floats, result: npt.NDArray[Any], rows: Integers) -> None:
    """Fill in the source's face and the place in it for texels whose triangle is known."""
    triangle = result["triangle"][rows]
    vertex = carrying.target.faces[triangle]
    corner = result["corner"][rows].astype(np.float64)
    weights = np.column_stack([1 - corner.sum(axis=1), corner])
    point = interpolated(carrying.place, vertex, weights)
    normal = interpolated(carrying.normal, vertex, weights)
    start = np.take_along_axis(carrying.at[vertex], weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    face, place, outside = _walk(carrying, start, point, normal)
    for k in range(3):
        again = np.flatnonzero(outside > INSIDE)
        if len(again) == 0:
            break
        other = _walk(carrying, carrying.at[vertex[again, k]], point[again], normal[again])
        better = other[2] < outside[again]
        face[again[better]], place[again[better]], outside[again[better]] = (x[better] for x in other)
    lost = np.flatnonzero((outside > INSIDE) | _astray(carrying, face, place, point, vertex))
    if len(lost):
        at = carrying.at[vertex[lost]]
        face[lost], place[lost], _ = nearest_from(carrying.source, carrying.beyond, at, point[lost])
    result["face"][rows], result["place"][rows] = face, place[:, 1:]
    corners = layout[triangle]
    sides = corners[:, [1, 2, 0]] - corners[:, [2, 0, 1]]
    gradient = coordinates(corners, sides[:, 1, 0] * sides[:, 2, 1] - sides[:, 1, 1] * sides[:, 2, 0])[0][:, :, 1:]
    ends = carrying.source.vertices[carrying.source.faces[face]]
    sides = ends[:, [1, 2, 0]] - ends[:, [2, 0, 1]]
    slope = np.cross(sides, normal[:, None])
    total = (normal * np.cross(sides[:, 1], sides[:, 2])).sum(axis=1)
    step = np.einsum("qke,qkd->qed", gradient, carrying.place[vertex])
    change = np.einsum("qed,qkd->qek", step, slope)[:, :, 1:]
    change = np.divide(change, total[:, None, None], out=np.zeros_like(change), where=total[:, None, None] > 0)
    result["across"][rows], result["down"][rows] = change[:, 0], change[:, 1]


def _walk(carrying: Carrying, start: Integers, point: Floats, normal: Floats) -> tuple[Integers, Floats, Floats]:
    """Walk over the source from faces, (q,), to those that the lines through points along normals meet.

    Returns
    -------
    (q,) int, (q, 3) float64, (q,) float64
        The face, the place in it, and how far outside of it the line passes, in barycentric coordinates: 0 if it does
        not, inf if the face is turned away.
    """
    here, before = start.copy(), np.full(len(start), -1)
    face, outside = start.copy(), np.full(len(start), np.inf)
    place = np.full((len(start), 3), 1 / 3)
    going = np.arange(len(start))
    for step in range(STEPS):
        ends = carrying.source.vertices[carrying.source.faces[here[going]]] - point[going, None]
        sides = np.cross(ends[:, [1, 2, 0]], ends[:, [2, 0, 1]])
        share = np.einsum("qkd,qd->qk", sides, normal[going])
        total = share.sum(axis=1)
        beside = np.maximum(-share.min(axis=1), 0)
        beside = np.divide(beside, total, out=np.full(len(total), np.inf), where=total > 0)
        better = (beside < outside[going]) | (step == 0)
        at = going[better]
        outside[at], face[at] = beside[better], here[at]
        facing = better & (total > 0)
        place[going[facing]] = share[facing] / total[facing, None]
        around = carrying.beyond[here[going]]
        open_side = (around >= 0) & (around != before[going, None]) & (share < 0)
        lowest = np.where(open_side, share, 0).argmin(axis=1)
        on = (beside > INSIDE) & open_side.any(axis=1)
        before[going[on]] = here[going[on]]
        here[going[on]] = around[on, lowest[on]]
        going = going[on]
        if len(going) == 0:
            break
    place = np.maximum(place, 0)
    return face, place / place.sum(axis=1, keepdims=True), outside


def _astray(carrying: Carrying, face: Integers, place: Floats, point: Floats, vertex: Integers) -> Booleans:
    """Return which places on faces are farther from points than the farthest of the places that these lie between."""
    found = interpolated(carrying.source.vertices, carrying.source.faces[face], place)
    reach = ((carrying.place[vertex] - point[:, None]) ** 2).sum(axis=2).max(axis=1)
    return ((found - point) ** 2).sum(axis=1) > reach
