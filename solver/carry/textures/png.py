"""PNG files of bytes, row by row, as ISO/IEC 15948 says: what Blender itself writes goes through floats, 16 a texel."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

_COLOR_TYPES = {1: 0, 3: 2, 4: 6}
_ROWS = 64
_LEVEL = 2
"""Of deflate: a picture with noise is hardly smaller at higher ones, and takes three times as long."""


def png_bytes(pixels: npt.NDArray[np.uint8]) -> bytes:
    """Return the file of a picture, (height, width, channels), grey, RGB or RGBA; the first row is the lowest."""
    height, width, channels = pixels.shape
    rows = pixels[::-1].reshape(height, width * channels)
    packer = zlib.compressobj(_LEVEL)
    packed = []
    for first in range(0, height, _ROWS):
        own = rows[first : first + _ROWS]
        # filter 2: the difference from the row above
        lines = np.full((len(own), 1 + own.shape[1]), 2, np.uint8)
        lines[1:, 1:] = own[1:] - own[:-1]
        lines[0, 1:] = own[0] - rows[first - 1] if first else own[0]
        packed.append(packer.compress(lines.tobytes()))
    packed.append(packer.flush())
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOR_TYPES[channels], 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", b"".join(packed)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(name)))
