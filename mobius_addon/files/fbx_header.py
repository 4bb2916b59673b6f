"""Whether the records of a binary FBX file lie within each other, and their arrays within them.

Blender's importer makes room for what an array is said to unpack to, before it unpacks it.
"""

from __future__ import annotations

import struct
from pathlib import Path

from .unreadable import Unreadable, cut_short

_MAGIC = b"Kaydara FBX Binary  "
_SIZES = {b"Z": 1, b"Y": 2, b"B": 1, b"C": 1, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
_STRIDES = {b"b": 1, b"c": 1, b"i": 4, b"l": 8, b"f": 4, b"d": 8}
_MOST = 1032
"""Bytes that one byte of zlib's data can at most unpack to."""


def check(path: Path) -> None:
    """Raise `Unreadable` if a binary FBX file is cut short or asks for more than it holds; texts are not looked at."""
    content = path.read_bytes()
    if content[:20] != _MAGIC:
        return
    if len(content) < 27:
        raise cut_short(path, "it ends in its header", 27, len(content))
    numbers = "<III" if struct.unpack_from("<I", content, 23)[0] < 7500 else "<QQQ"
    waiting = [(27, len(content))]
    while waiting:
        place, limit = waiting.pop()
        start = place + struct.calcsize(numbers) + 1
        if start > limit:
            raise cut_short(path, "its last record is not there", start, limit)
        end, count, length = struct.unpack_from(numbers, content, place)
        if end == 0:
            continue  # the last of its level
        inside = start + content[start - 1]
        if end > limit:
            raise cut_short(path, f"a record at byte {place:,} goes on", end, limit)
        if end <= place or inside + length > end:
            raise Unreadable(f"'{path}' is damaged: a record at byte {place:,} does not hold what it says")
        _follow_properties(path, content, count, inside, inside + length)
        if end < limit:
            waiting.append((end, limit))
        if inside + length < end:
            waiting.append((inside + length, end))


def _follow_properties(path: Path, content: bytes, count: int, place: int, end: int) -> None:
    """Go from value to value of a record."""
    begin = place
    for _ in range(count):
        kind = content[place : place + 1] if place < end else b""
        place += 1
        if kind in _SIZES:
            place += _SIZES[kind]
        elif kind in (b"R", b"S") and place + 4 <= end:
            place += 4 + struct.unpack_from("<I", content, place)[0]
        elif kind in _STRIDES and place + 12 <= end:
            values, packed, length = struct.unpack_from("<III", content, place)
            place += 12 + length
            if values * _STRIDES[kind] > (_MOST * length if packed else length):
                raise cut_short(path, f"it asks for {values:,} values", values * _STRIDES[kind], length)
        else:
            raise Unreadable(f"'{path}' is damaged: a record at byte {begin:,} does not hold what it says")
    if place != end:
        raise Unreadable(f"'{path}' is damaged: a record at byte {begin:,} does not hold what it says")
