"""The transfer map: where each texel of the target lies in the source's layout, as a picture to be kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...surface.mesh import Floats, Integers
from .paints import Texels, Values, at_corners
from .picture import Pixels
from .reference import TEXEL

FARTHEST = 1 / 16
"""Two texels side by side whose places in the source's layout are farther apart are on two sides of a seam."""


@dataclass(frozen=True, eq=False)
class MapPaint:
    """Writes u, v, the number of the material and the confidence: the texels of a transfer map.

    Attributes
    ----------
    uv : (f, 3, 2) float64
        The source's layout.
    material : (f,) int
        Of each face of the source.
    confidence : (m, 3) float64
        At the corners of the target's triangles.
    """

    uv: Floats
    material: Integers
    confidence: Floats

    channels = 4

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write the places of texels; see `paints.Paint`."""
        rows = np.flatnonzero(texels["face"] >= 0)
        own = texels[rows]
        out[rows, :2] = at_corners(self.uv, own["face"], own["place"])
        out[rows, 2] = self.material[own["face"]]
        out[rows, 3:] = at_corners(self.confidence[:, :, None], own["triangle"], own["corner"])


NOWHERE = -1.0
"""The number of the material where a texel lies nowhere on the source."""


@dataclass(frozen=True, eq=False)
class TransferMap:
    """A transfer map that was kept, for further pictures of the source.

    Attributes
    ----------
    pixels : (height, width, 4) float32
        u, v, number of the material, `NOWHERE` for none, and confidence.
    pages : mapping of (int, int) to int
        The page that faces of a material show in a tile, 1001 and on; those that are not listed show none.
    """

    pixels: Pixels
    pages: Mapping[tuple[int, int], int]

    def texels(self, first: int, rows: int) -> tuple[Texels, int]:
        """Return the texels of some rows, as `reference.texels`, whose face is the page and whose place is u, v.

        Their triangle is the number of the texel in the map, row by row.

        How u and v change is taken from the neighbour to which they change less: not from one beyond a seam.
        """
        _, width = self.pixels.shape[:2]
        result = np.zeros((rows, width), TEXEL)
        own = self.pixels[first : first + rows]
        material = np.rint(np.nan_to_num(own[:, :, 2], nan=NOWHERE)).astype(np.intp)
        tile = np.floor(np.nan_to_num(own[:, :, :2])).astype(np.intp)
        page = np.full((rows, width), -1)
        for (slot, which), wanted in self.pages.items():
            row, column = divmod(which - 1001, 10)
            page[(material == slot) & (tile[:, :, 0] == column) & (tile[:, :, 1] == row)] = wanted
        number = np.arange(first * width, (first + rows) * width).reshape(rows, width)
        result["triangle"] = np.where(page >= 0, number, -1)
        result["face"] = page
        result["place"] = own[:, :, :2] - tile
        around = self.pixels[max(first - 1, 0) : first + rows + 1]
        above = first - max(first - 1, 0)
        result["across"] = _slopes(own, axis=1)
        result["down"] = _slopes(around, axis=0)[above : above + rows]
        return result, 0


def _slopes(pixels: Pixels, axis: int) -> npt.NDArray[np.float32]:
    """Return the change of u and v from texel to texel along an axis; 0 where neither neighbour is near."""
    uv, material = np.moveaxis(pixels[:, :, :2], axis, 0), np.moveaxis(pixels[:, :, 2], axis, 0)
    step = np.full((len(uv) + 1, *uv.shape[1:]), np.inf, np.float32)
    same = material[1:] == material[:-1]
    step[1:-1] = np.where(same[:, :, None], uv[1:] - uv[:-1], np.inf)
    length = np.abs(step).max(axis=2, keepdims=True)
    nearer = np.where(length[1:] < length[:-1], step[1:], step[:-1])
    return np.moveaxis(np.where(np.abs(nearer).max(axis=2, keepdims=True) < FARTHEST, nearer, 0), 0, axis)
