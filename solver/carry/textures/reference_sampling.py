"""Reading pictures, and labelling their islands, in numpy: the other half of `reference`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...surface.mesh import Booleans, Floats, Integers
from .picture import EXTEND, MIRROR, REPEAT, Picture
from .raster import touched

TRACE = 0.25
"""Of a byte: how much a texel counts that cannot be seen. Beside one that can it is next to nothing."""


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
    if wrap in (REPEAT, MIRROR):
        there = index % (size if wrap == REPEAT else 2 * size)
        return np.minimum(there, 2 * size - 1 - there), np.ones(len(index), bool)
    within = (index >= 0) & (index < size)
    return np.clip(index, 0, size - 1), within | (wrap == EXTEND)


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
    for triangle, x, y, weights, inside, depth in touched(own - origin, 0, int(extent[1]), int(extent[0])):
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
