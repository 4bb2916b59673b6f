"""Pictures as arrays: what their bytes stand for, and which of their texels belong together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[Any]
"""(height, width, channels) uint8 or float32; the first row is the lowest, where v is 0."""

REPEAT, EXTEND, CLIP = 0, 1, 2
"""What lies beyond the edge of a picture: the picture again, its last texels, or nothing."""

_FINE = 1 << 16
"""Steps in which linear values are looked up: the steepest part of sRGB rises by 1/20 of a byte in one."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture that is read from.

    Attributes
    ----------
    pixels : (height, width, channels) uint8 or float32
        Up to 4 channels.
    table : (channels, 256) float32 or None
        What each byte of each channel stands for; None for floats.
    wrap : int
        `REPEAT`, `EXTEND` or `CLIP`.
    label : (height, width) uint16 or None
        The island of a layout that each texel belongs to, 0 for none; None: all may be read from everywhere.
    """

    pixels: Pixels
    table: npt.NDArray[np.float32] | None
    wrap: int = EXTEND
    label: npt.NDArray[np.uint16] | None = None

    @staticmethod
    def of(pixels: Pixels, *, srgb: bool = False, wrap: int = EXTEND) -> Picture:
        """Return a picture of pixels, whose colors, if they are bytes, are linear or sRGB (a fourth channel never)."""
        if pixels.dtype != np.uint8:
            return Picture(np.ascontiguousarray(pixels, np.float32), None, wrap)
        table = np.stack([srgb_bytes() if srgb and k < 3 else linear_bytes() for k in range(pixels.shape[2])])
        return Picture(np.ascontiguousarray(pixels), table, wrap)

    def values(self, pixels: Pixels) -> npt.NDArray[np.float32]:
        """Return what some of the pixels, (q, channels), stand for."""
        if self.table is None:
            return pixels
        return np.stack([table[column] for table, column in zip(self.table, pixels.T, strict=True)], axis=1)


def encoded(values: npt.NDArray[np.float32], *, srgb: bool) -> npt.NDArray[np.uint8]:
    """Return values, (n, channels), as bytes; colors as sRGB or as they are, a fourth channel always as it is."""
    values = np.nan_to_num(values)
    if not srgb:
        return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
    result = np.empty(values.shape, np.uint8)
    result[:, :3] = _to_srgb()[(np.clip(values[:, :3], 0, 1) * _FINE + 0.5).astype(np.int32)]
    result[:, 3:] = encoded(values[:, 3:], srgb=False)
    return result


@cache
def linear_bytes() -> npt.NDArray[np.float32]:
    """Return bytes as shares of 255, (256,)."""
    return (np.arange(256) / 255).astype(np.float32)


@cache
def srgb_bytes() -> npt.NDArray[np.float32]:
    """Return the linear value of each byte of sRGB, (256,); IEC 61966-2-1."""
    share = np.arange(256) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(np.float32)


@cache
def _to_srgb() -> npt.NDArray[np.uint8]:
    linear = np.arange(_FINE + 1) / _FINE
    share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255 * share + 0.5).astype(np.uint8)


def with_margin(label: npt.NDArray[np.uint16], pixels: Pixels) -> None:
    """Label texels of the background, in place, that continue an island beside them, as those of a margin do.

    They are half a texel nearer to what a face shows at its border. One continues an island if it differs from the
    island's nearest texel by no more than twice what that differs from the next, and by rounding; black beside a face
    does not.
    """
    height, width = label.shape
    rounding = 4 if pixels.dtype == np.uint8 else 0.0
    flat, colors = label.reshape(-1), pixels.reshape(-1, pixels.shape[2])
    found = []
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        rows = slice(max(-2 * dy, 0), height - max(2 * dy, 0))
        columns = slice(max(-2 * dx, 0), width - max(2 * dx, 0))
        beside = label[rows.start + dy : rows.stop + dy, columns.start + dx : columns.stop + dx]
        y, x = np.nonzero((label[rows, columns] == 0) & (beside > 0))
        at = (y + rows.start) * width + x + columns.start
        step = dy * width + dx
        at = at[flat[at + 2 * step] == flat[at + step]]
        here, near, next_one = (colors[at + k * step].astype(np.float32) for k in range(3))
        goes_on = (np.abs(here - near) <= 2 * np.abs(near - next_one) + rounding).all(axis=1)
        found.append((at[goes_on], flat[at + step][goes_on]))
    for at, own in found:
        free = flat[at] == 0
        flat[at[free]] = own[free]


def merged(label: npt.NDArray[np.uint16], parent: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """Give islands that overlap one number, in place, and return the number of each that there was, (65536,).

    `parent`, (65536,), points from each to one of a smaller number.
    """
    own = np.arange(len(parent))
    root = own.copy()
    for number in np.flatnonzero(parent != own):  # ascending, so that the parent's root is known
        root[number] = root[parent[number]]
    table = root.astype(np.uint16)
    if (root != own).any():
        for row in label:
            row[:] = table[row]
    return table
