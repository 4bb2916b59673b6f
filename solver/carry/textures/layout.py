"""UV layouts as pictures see them: tiles, islands, and how many texels a surface has."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...surface.mesh import Floats, Integers, plural
from ..charts import value_islands

SLACK = 1e-3
"""How far a face may reach beyond its tile: the half texel or so that unwrapping leaves, in 512 texels."""

MOST_ISLANDS = 65535
"""Numbers that a label of 16 bits has beside 0."""

SIZES = (256, 8192)
"""Of pictures whose size is chosen for the person, at least and at most."""


class LayoutError(ValueError):
    """A UV layout cannot hold a picture; the text goes on after the layout's name."""


def place_in_tiles(corners: Floats) -> tuple[Integers, Floats]:
    """Return the UDIM tile, 1001 and on, of each triangle of a layout, (m,), and its corners there, (m, 3, 2).

    Triangles without area are in tile 0, which is none.

    Raises
    ------
    LayoutError
        Nothing has an area, or triangles lie across the border of a tile, left of or below the first, or beyond the
        tenth of a row.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    flat = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) < 1e-14
    flat |= ~np.isfinite(corners).all(axis=(1, 2))
    if flat.all():
        raise LayoutError("has no area: unwrap the mesh first")
    column, row = np.floor(np.where(flat[:, None], 0, corners.mean(axis=1))).astype(np.intp).T
    local = corners - np.stack([column, row], axis=1)[:, None]
    across = ((local < -SLACK) | (local > 1 + SLACK)).any(axis=(1, 2)) & ~flat
    if across.any():
        number = plural(int(across.sum()), "face")
        raise LayoutError(f"has {number} across the border of a tile: move its islands into whole tiles")
    outside = ((column < 0) | (column > 9) | (row < 0)) & ~flat
    if outside.any():
        number = plural(int(outside.sum()), "face")
        raise LayoutError(f"has {number} outside of all tiles: move its islands to between 0 and 1, or into UDIM tiles")
    return np.where(flat, 0, 1001 + column + 10 * row), local


def in_texels(corners: Floats, width: int, height: int) -> Floats:
    """Return UVs, (..., 2), in texels: the middle of the first one is (0, 0)."""
    return corners * [width, height] - 0.5


def island_numbers(triangles: Integers, corners: Floats) -> npt.NDArray[np.uint16]:
    """Return the number, from 1, of the island of a layout that each triangle is in, (m,)."""
    island = value_islands(triangles, corners.reshape(-1, 2))
    return (island % MOST_ISLANDS + 1).astype(np.uint16)


def plane_areas(corners: Floats) -> Floats:
    """Return the areas of triangles of a plane, (m, 3, 2)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def picture_size(texels: float, target: Floats) -> int:
    """Return the side of the square picture, a power of two, in which a layout has as many texels as its source.

    Rounded up from 1.19 (the fourth root of 2) times a power of two on.

    Parameters
    ----------
    texels : float
        On the part of the source that the target shows.
    target : (m, 3, 2) float64
        The target's layout, in its tiles.
    """
    side = np.sqrt(texels / max(float(plane_areas(target).sum()), 1e-12))
    return int(np.clip(2 ** np.ceil(np.log2(max(side, 1)) - 0.25), *SIZES))
