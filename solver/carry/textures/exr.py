"""OpenEXR files of 32-bit floats, written as "Technical Introduction to OpenEXR" and the file layout document say."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

_ROWS = 16
"""Scan lines in a block of ZIP compression."""


def exr_bytes(pixels: npt.NDArray[np.float32]) -> bytes:
    """Return the file of a picture, (height, width, 4), as red, green, blue and alpha; the first row is the lowest."""
    height, width = pixels.shape[:2]
    header = b"".join(_header(width, height))
    # scan lines from the top; in each the channels in the order of their names
    lines = np.ascontiguousarray(pixels[::-1, :, ::-1].transpose(0, 2, 1), "<f4")
    blocks = [
        struct.pack("<ii", first, len(packed)) + packed
        for first in range(0, height, _ROWS)
        for packed in [_packed(lines[first : first + _ROWS].tobytes())]
    ]
    offset = len(header) + 8 * len(blocks) + np.concatenate([[0], np.cumsum([len(block) for block in blocks])[:-1]])
    return header + offset.astype("<u8").tobytes() + b"".join(blocks)


def _header(width: int, height: int) -> Iterator[bytes]:
    yield struct.pack("<ii", 20000630, 2)
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in (b"A", b"B", b"G", b"R"))
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    for name, kind, value in (
        (b"channels", b"chlist", channels + b"\0"),
        (b"compression", b"compression", b"\3"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    ):
        yield name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    yield b"\0"


def _packed(raw: bytes) -> bytes:
    """Return a block by the ZIP compression: even bytes before odd ones, differences, deflate; raw if not shorter."""
    data = np.frombuffer(raw, np.uint8)
    data = np.concatenate([data[::2], data[1::2]])
    change = data.copy()
    change[1:] = data[1:] - data[:-1] + np.uint8(128)
    packed = zlib.compress(change.tobytes(), 4)
    return packed if len(packed) < len(raw) else raw
