"""texels.c through ctypes. The calls let go of Python's lock, so that threads run them side by side."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from ...search.kernels.compiled import library as kernels
from ...surface.mesh import Floats, Integers
from .carrying import Carrying
from .picture import Picture
from .reference import TEXEL

INTERFACE = 2
"""Of texels.c: a library that says another number, or none, is not used."""

_I64, _POINTER = ctypes.c_int64, ctypes.c_void_p


class _Carrying(ctypes.Structure):
    _fields_ = [
        ("triangles", _I64),
        *((name, _POINTER) for name in ("layout", "vertex", "place", "normal", "at", "source", "faces", "beyond")),
    ]


class _Picture(ctypes.Structure):
    _fields_ = [
        *((name, _I64) for name in ("width", "height", "channels")),
        *((name, _POINTER) for name in ("bytes", "floats", "table", "opaque", "label")),
        ("wrap", _I64),
    ]


@cache
def library() -> ctypes.CDLL | None:
    """Return the library with its functions declared, or None: it is not there, or of another version."""
    loaded = kernels()
    if loaded is None or getattr(loaded, "mobius_texels_interface", lambda: 0)() != INTERFACE:
        return None
    loaded.mobius_texels.restype = _I64
    loaded.mobius_texels.argtypes = [_POINTER, _I64, _I64, _I64, _POINTER, _POINTER]
    loaded.mobius_sample.restype = None
    loaded.mobius_sample.argtypes = [_POINTER, _I64, *[_POINTER] * 3, _I64, _POINTER, _I64, _POINTER]
    loaded.mobius_islands.restype = None
    loaded.mobius_islands.argtypes = [_I64, _POINTER, _POINTER, _I64, _POINTER, _I64, _I64, _I64, _POINTER, _POINTER]
    return loaded


def _library() -> ctypes.CDLL:
    loaded = library()
    assert loaded is not None
    return loaded


def texels(carrying: Carrying, layout: Floats, first: int, rows: int, width: int) -> tuple[npt.NDArray[Any], int]:
    """Return what `reference.texels` does."""
    result = np.zeros((rows, width), TEXEL)
    result["triangle"] = result["face"] = -1
    apart = np.full((rows, width), np.inf)
    arrays = {
        "layout": np.ascontiguousarray(layout, np.float64),
        "vertex": np.ascontiguousarray(carrying.target.faces, np.int32),
        "place": np.ascontiguousarray(carrying.place),
        "normal": np.ascontiguousarray(carrying.normal),
        "at": np.ascontiguousarray(carrying.at, np.int32),
        "source": carrying.source.vertices,
        "faces": np.ascontiguousarray(carrying.source.faces, np.int32),
        "beyond": np.ascontiguousarray(carrying.beyond, np.int32),
    }
    given = _Carrying(len(layout), *(x.ctypes.data for x in arrays.values()))
    overlaps = _library().mobius_texels(
        ctypes.addressof(given), first, rows, width, result.ctypes.data, apart.ctypes.data
    )
    return result, int(overlaps)


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
    """Do what `reference.sample` does."""
    assert out.dtype == np.float32
    assert out.flags.c_contiguous
    assert given.flags.c_contiguous
    pixels = np.ascontiguousarray(picture.pixels)
    page, corners = np.ascontiguousarray(page, np.int32), np.ascontiguousarray(corners, np.float64)
    table = None if picture.table is None else np.ascontiguousarray(picture.table, np.float32)
    label = None if picture.label is None else picture.label.ctypes.data
    in_bytes = pixels.dtype == np.uint8
    seen = _Picture(
        pixels.shape[1],
        pixels.shape[0],
        pixels.shape[2],
        pixels.ctypes.data if in_bytes else None,
        None if in_bytes else pixels.ctypes.data,
        None if table is None else table.ctypes.data,
        None if picture.opaque is None else picture.opaque.ctypes.data,
        label,
        picture.wrap,
    )
    _library().mobius_sample(
        ctypes.addressof(seen), len(given), given.ctypes.data, corners.ctypes.data, page.ctypes.data, wanted,
        island.ctypes.data, limit, out.ctypes.data,
    )  # fmt: skip


def islands(
    corners: Floats,
    page: Integers,
    wanted: int,
    island: npt.NDArray[np.uint16],
    wrap: int,
    label: npt.NDArray[np.uint16],
    parent: npt.NDArray[np.uint16],
) -> None:
    """Do what `reference.islands` does."""
    page, corners = np.ascontiguousarray(page, np.int32), np.ascontiguousarray(corners, np.float64)
    height, width = label.shape
    _library().mobius_islands(
        len(corners), corners.ctypes.data, page.ctypes.data, wanted, island.ctypes.data, width, height, wrap,
        label.ctypes.data, parent.ctypes.data,
    )  # fmt: skip
