"""Reads the first picture of a GIF file, enough for the silhouettes of the MPEG-7 set."""

from pathlib import Path

import numpy as np


def read_gif(path: Path) -> np.ndarray:
    """Return the brightness of each pixel, (height, width), 0 to 255."""
    data = path.read_bytes()
    assert data[:3] == b"GIF"
    palette, at = _palette(data, data[10], 13)
    while data[at] != 0x2C:  # skip extensions up to the picture
        at = _after_blocks(data, at + 2)
    width, height = np.frombuffer(data, "<u2", 2, at + 5)
    flags = data[at + 9]
    local, at = _palette(data, flags, at + 10)
    palette = palette if local is None else local
    least, at, packed = data[at], at + 1, bytearray()
    while size := data[at]:
        packed += data[at + 1 : at + 1 + size]
        at += 1 + size
    rows = np.frombuffer(_unpacked(packed, least)[: int(width) * int(height)], np.uint8).reshape(height, width)
    if flags & 0x40:  # interlaced
        order = [row for first, step in ((0, 8), (4, 8), (2, 4), (1, 2)) for row in range(first, int(height), step)]
        rows = rows[np.argsort(order)]
    return palette[rows]


def _palette(data: bytes, flags: int, at: int) -> tuple[np.ndarray | None, int]:
    if not flags & 0x80:
        return None, at
    count = 2 << (flags & 7)
    return np.frombuffer(data, np.uint8, 3 * count, at).reshape(-1, 3).mean(axis=1), at + 3 * count


def _after_blocks(data: bytes, at: int) -> int:
    while data[at]:
        at += 1 + data[at]
    return at + 1


def _unpacked(packed: bytes, least: int) -> bytes:
    """Undo the LZW compression of code size `least`."""
    clear, end = 1 << least, (1 << least) + 1
    words, size, before, result = [], least + 1, b"", bytearray()
    held = bits = 0
    for byte in packed:
        held |= byte << bits
        bits += 8
        while bits >= size:
            code, held, bits = held & ((1 << size) - 1), held >> size, bits - size
            if code == end:
                return bytes(result)
            if code == clear:
                words, size, before = [bytes([k]) for k in range(clear)] + [b"", b""], least + 1, b""
                continue
            word = words[code] if code < len(words) else before + before[:1]
            result += word
            if before and len(words) < 4096:
                words.append(before + word[:1])
            before = word
            if len(words) == 1 << size and size < 12:
                size += 1
    return bytes(result)
