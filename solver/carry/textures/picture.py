"""Pictures as arrays: what their bytes stand for, and which of their texels belong together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[Any]
"""(height, width, channels) uint8 or float32; the first row is the lowest, where v is 0."""

REPEAT, EXTEND, CLIP, MIRROR = 0, 1, 2, 3
"""What lies beyond the edge of a picture: the picture again, its last texels, nothing, or the picture mirrored."""

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
        `REPEAT`, `EXTEND`, `CLIP` or `MIRROR`.
    label : (height, width) uint16 or None
        The island of a layout that each texel belongs to, 0 for none; None: all may be read from everywhere.
    opaque : (height, width) uint8 or None
        How much each texel counts between others: what cannot be seen has no say in the color beside it.
    """

    pixels: Pixels
    table: npt.NDArray[np.float32] | None
    wrap: int = EXTEND
    label: npt.NDArray[np.uint16] | None = None
    opaque: npt.NDArray[np.uint8] | None = None

    @staticmethod
    def of(
        pixels: Pixels, *, srgb: bool = False, wrap: int = EXTEND, opaque: npt.NDArray[np.uint8] | None = None
    ) -> Picture:
        """Return a picture of pixels, whose colors, if they are bytes, are linear or sRGB (a fourth channel never)."""
        if opaque is not None:
            opaque = np.ascontiguousarray(opaque)
        if pixels.dtype != np.uint8:
            return Picture(np.ascontiguousarray(pixels, np.float32), None, wrap, opaque=opaque)
        table = np.stack([srgb_bytes() if srgb and k < 3 else linear_bytes() for k in range(pixels.shape[2])])
        return Picture(np.ascontiguousarray(pixels), table, wrap, opaque=opaque)

    def values(self, pixels: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return what some pixels, (q, channels), stand for; between two bytes linearly."""
        if self.table is None:
            return pixels
        byte = np.arange(256)
        return np.stack([np.interp(x, byte, table) for table, x in zip(self.table, pixels.T, strict=True)], axis=1)


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


_AROUND = tuple((dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx)


def with_margin(label: npt.NDArray[np.uint16], pixels: Pixels) -> None:
    """Label texels of the background, in place, that continue an island beside them, as those of a margin do.

    They are half a texel nearer to what a face shows at its border. One continues an island if it differs from a texel
    of it beside itself by no more than twice what that one differs from others beside it, and by rounding; black
    beside a face does not.
    """
    height, width = label.shape
    beside = np.zeros(label.shape, bool)
    for dy, dx in _AROUND:
        here, there = _shifted(height, dy), _shifted(width, dx)
        beside[here[0], there[0]] |= label[here[1], there[1]] > 0
    beside &= label == 0
    at = np.flatnonzero(beside)
    given = label.copy()
    rounding = 4 if pixels.dtype == np.uint8 else 0.0
    for dy, dx in _AROUND:
        at = at[label.reshape(-1)[at] == 0]
        y, x = np.divmod(at, width)
        inside = (y + dy >= 0) & (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        y, x = y[inside], x[inside]
        own = given[y + dy, x + dx]
        y, x, own = y[own > 0], x[own > 0], own[own > 0]
        near = pixels[y + dy, x + dx].astype(np.float32)
        rough = np.full(near.shape, -1.0, np.float32)
        for down, right in _AROUND:
            row, column = y + dy + down, x + dx + right
            there = (row >= 0) & (row < height) & (column >= 0) & (column < width)
            there[there] = given[row[there], column[there]] == own[there]
            change = np.abs(near[there] - pixels[row[there], column[there]])
            rough[there] = np.maximum(rough[there], change)
        goes_on = (np.abs(pixels[y, x] - near) <= 2 * rough + rounding).all(axis=1) & (rough >= 0).all(axis=1)
        label[y[goes_on], x[goes_on]] = own[goes_on]


def _shifted(size: int, step: int) -> tuple[slice, slice]:
    """Return where the rows, or columns, are that have one a step away, and where those are."""
    return slice(max(-step, 0), size - max(step, 0)), slice(max(step, 0), size - max(-step, 0))


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
