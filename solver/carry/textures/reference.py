"""The inner loops in numpy: the specification, the fallback, and what `texels.c` is tested against."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...surface.mesh import Booleans, Floats, Integers
from ...surface.walking import STEPS, nearest_from
from .carrying import Carrying
from .picture import Picture

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

DEPTH = 0.01
"""Islands, or triangles, that overlap by less, in texels, only touch: the rounding of float32 UVs in 8192 texels."""

TRACE = 0.25
"""Of a byte: how much a texel counts that cannot be seen. Beside one that can it is next to nothing."""

_CANDIDATES = 1 << 19
"""Texels looked at in one go."""


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
    for triangle, x, y, weights, inside, depth in _touched(layout, first, rows, width):
        at = (y - first) * width + x
        square = np.zeros(len(at))
        outside = np.flatnonzero(~inside)
        weights[outside], square[outside] = _nearest(layout[triangle[outside]], x[outside], y[outside])
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
    for some in np.array_split(np.flatnonzero(known), known.sum() // _CANDIDATES + 1):
        if len(some):
            _place(carrying, layout, result, some)
    return result.reshape(rows, width), overlaps


def _touched(layout: Floats, first: int, rows: int, width: int) -> Any:
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
    piece = np.cumsum(count[order]) // _CANDIDATES
    for some in np.split(order, np.flatnonzero(np.diff(piece)) + 1):
        triangle = np.repeat(some, count[some])
        if len(triangle) == 0:
            continue
        number = np.arange(len(triangle)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
        row, column = np.divmod(number, extent[triangle, 0])
        x, y = low[triangle, 0] + column, low[triangle, 1] + row
        weights, slope = _coordinates(layout[some], area[some])
        local = np.repeat(np.arange(len(some)), count[some])
        value = weights[local, :, 0] + weights[local, :, 1] * x[:, None] + weights[local, :, 2] * y[:, None]
        reach = 0.5 * np.abs(weights[:, :, 1:]).sum(axis=2)
        touched = np.flatnonzero((value >= -reach[local]).all(axis=1))
        inside = (value[touched] >= 0).all(axis=1)
        depth = DEPTH * slope[local[touched]]
        yield triangle[touched], x[touched], y[touched], value[touched], inside, depth


def _coordinates(corners: Floats, area: Floats) -> tuple[Floats, Floats]:
    """Return barycentric coordinates as constant, factor of x and factor of y, (m, 3, 3), and their slope, (m, 3)."""
    x, y = corners[:, :, 0], corners[:, :, 1]
    i, j = [1, 2, 0], [2, 0, 1]
    result = np.stack([x[:, i] * y[:, j] - x[:, j] * y[:, i], y[:, i] - y[:, j], x[:, j] - x[:, i]], axis=2)
    result /= area[:, None, None]
    return result, np.hypot(result[:, :, 1], result[:, :, 2])


def _nearest(corners: Floats, x: Integers, y: Integers) -> tuple[Floats, Floats]:
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


def _place(carrying: Carrying, layout: Floats, result: npt.NDArray[Any], rows: Integers) -> None:
    """Fill in the source's face and the place in it for texels whose triangle is known."""
    triangle = result["triangle"][rows]
    vertex = carrying.target.faces[triangle]
    corner = result["corner"][rows].astype(np.float64)
    weights = np.column_stack([1 - corner.sum(axis=1), corner])
    point = np.einsum("qk,qkd->qd", weights, carrying.place[vertex])
    normal = np.einsum("qk,qkd->qd", weights, carrying.normal[vertex])
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
    gradient = _coordinates(corners, sides[:, 1, 0] * sides[:, 2, 1] - sides[:, 1, 1] * sides[:, 2, 0])[0][:, :, 1:]
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
    found = np.einsum("qk,qkd->qd", place, carrying.source.vertices[carrying.source.faces[face]])
    reach = ((carrying.place[vertex] - point[:, None]) ** 2).sum(axis=2).max(axis=1)
    return ((found - point) ** 2).sum(axis=1) > reach


def sample(
    picture: Picture,
    given: npt.NDArray[Any],
    corners: Floats,
    page: Integers,
    wanted: int,
    island: npt.NDArray[np.uint16],
    limit: int,
    out: npt.NDArray[np.float32],
) -> None:
    """Write the mean of a picture over each of some texels, (n,), whose face is on the wanted page, into (n, channels).

    The mean is that of bilinear values at a grid of points over the texel's image in the picture, one to each of the
    picture's texels along its two sides, `limit` at most. A texel of the picture is a mean over its own width already,
    and variances of filters add: over a side of L texels what is left is a mean over sqrt(L^2 - 1), of as many points.
    Bilinear are the bytes, as in renderers that decode what they have read: steps of sRGB look alike, those of light do
    not, and between dark and bright the middle of the light looks bright. Means over areas are means of light. Of the
    picture only texels count that are labelled as the face's island, if there are any, each as much as it is opaque.

    Parameters
    ----------
    picture : Picture
    given : (n,) TEXEL
    corners : (f, 3, 2) float64
        Where the source's faces lie in the picture, in texels.
    page : (f,) int
    wanted : int
    island : (f,) uint16
    limit : int
    out : (n, channels) float32
    """
    rows = np.flatnonzero((given["face"] >= 0) & (page[given["face"]] == wanted))
    if len(rows) == 0:
        return
    face = given["face"][rows]
    own = corners[face]
    u, v = own[:, 1] - own[:, 0], own[:, 2] - own[:, 0]

    def moved(name: str) -> Floats:
        place = given[name][rows].astype(np.float64)
        return place[:, :1] * u + place[:, 1:] * v

    middle, across, down = own[:, 0] + moved("place"), moved("across"), moved("down")
    label = island[face] if picture.label is not None else np.zeros(len(face), np.uint16)
    wide = [np.sqrt(np.maximum((x**2).sum(axis=1) - 1, 0)) for x in (across, down)]
    steps = [np.clip(np.ceil(x), 1, limit).astype(int) for x in wide]
    sums, total = np.zeros((len(rows), out.shape[1])), np.zeros(len(rows))
    for a in range(steps[0].max()):
        for b in range(steps[1].max()):
            some = np.flatnonzero((a < steps[0]) & (b < steps[1]))
            s, r = (a + 0.5) / steps[0][some] - 0.5, (b + 0.5) / steps[1][some] - 0.5
            at = middle[some] + s[:, None] * across[some] + r[:, None] * down[some]
            value, weight = _bilinear(picture, at, label[some])
            sums[some] += value
            total[some] += weight
    bare = np.flatnonzero(total <= 0)
    if len(bare):  # a face of no width, as of a layout that was never made
        sums[bare], total[bare] = _bilinear(picture, middle[bare], np.zeros(len(bare), np.uint16))
    out[rows] = sums / total[:, None]


def _bilinear(picture: Picture, at: Floats, own: npt.NDArray[np.uint16]) -> tuple[Floats, Floats]:
    """Return weighted sums of the four texels around points, (q, channels), and the weights that count, (q,)."""
    height, width = picture.pixels.shape[:2]
    low = np.floor(at)
    part = at - low
    sums, total = np.zeros((len(at), picture.pixels.shape[2])), np.zeros(len(at))
    for j in (0, 1):
        for i in (0, 1):
            weight = np.where(i, part[:, 0], 1 - part[:, 0]) * np.where(j, part[:, 1], 1 - part[:, 1])
            column, within = wrapped(low[:, 0].astype(np.intp) + i, width, picture.wrap)
            row, above = wrapped(low[:, 1].astype(np.intp) + j, height, picture.wrap)
            there = within & above
            right = own == 0
            if picture.label is not None:
                right |= there & (picture.label[row, column] == own)
            weight = np.where(right, weight, 0)
            if picture.opaque is not None:
                weight = np.where(there, weight * ((picture.opaque[row, column] + TRACE) / 255), weight)
            total += weight
            sums += np.where(there, weight, 0)[:, None] * picture.pixels[row, column]
    mean = np.divide(sums, total[:, None], out=np.zeros_like(sums), where=total[:, None] > 0)
    return total[:, None] * picture.values(mean), total


def wrapped(index: Integers, size: int, wrap: int) -> tuple[Integers, Booleans]:
    """Return which rows, or columns, of a picture those beyond its edge are, and whether they are any."""
    if wrap == 0:
        return index % size, np.ones(len(index), bool)
    within = (index >= 0) & (index < size)
    return np.clip(index, 0, size - 1), within | (wrap == 1)


def islands(
    corners: Floats,
    page: Integers,
    wanted: int,
    island: npt.NDArray[np.uint16],
    wrap: int,
    label: npt.NDArray[np.uint16],
    parent: npt.NDArray[np.uint16],
) -> None:
    """Label the texels of a picture, (height, width), whose middle is in an island of the faces on the wanted page.

    Those that it only touches are left out: where nobody has added a margin they are background. Islands that overlap
    become one in `parent`, (65536,).
    """
    height, width = label.shape
    faces = np.flatnonzero((page == wanted) & (np.ptp(corners, axis=1) < [2 * width, 2 * height]).all(axis=1))
    if len(faces) == 0:
        return
    own = corners[faces]
    origin = np.floor(own.min(axis=(0, 1))).astype(np.intp) - 1
    extent = np.ceil(own.max(axis=(0, 1))).astype(np.intp) + 2 - origin

    def root(number: int) -> int:
        while parent[number] != number:
            number = int(parent[number])
        return number

    flat = label.reshape(-1)
    for triangle, x, y, weights, inside, depth in _touched(own - origin, 0, int(extent[1]), int(extent[0])):
        column, within = wrapped(x + origin[0], width, 2 if wrap == 1 else wrap)
        row, above = wrapped(y + origin[1], height, 2 if wrap == 1 else wrap)
        chosen = np.flatnonzero(inside & within & above)
        mine = island[faces[triangle[chosen]]]
        at = row[chosen] * width + column[chosen]
        free = np.flatnonzero(flat[at] == 0)
        first = free[np.unique(at[free], return_index=True)[1]]
        flat[at[first]] = mine[first]
        deep = (weights[chosen] > depth[chosen]).all(axis=1) & (flat[at] != mine)
        for pair in np.unique(np.stack([flat[at[deep]], mine[deep]], axis=1), axis=0).tolist():
            a, b = sorted(root(number) for number in pair)
            parent[b] = a
