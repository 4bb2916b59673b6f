"""Whether a .blend file is whole: its blocks, each of which says how long it is, up to the last one."""

from __future__ import annotations

import gzip
import struct
import zlib
from pathlib import Path
from typing import BinaryIO

from .unreadable import Unreadable, cut_short

_GZIP, _ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
_SEEK_TABLE = b"\xb1\xea\x92\x8f"
"""The last bytes of Zstandard data that can be sought in, which Blender writes."""


def check(path: Path) -> None:
    """Raise `Unreadable` if a .blend file ends before its last block."""
    with path.open("rb") as file:
        start = file.read(4)
        if start == _ZSTD:
            file.seek(-4, 2)
            if file.read(4) != _SEEK_TABLE:
                raise Unreadable(
                    f"'{path}' is cut short or damaged: its compressed data does not end as Blender's does"
                )
            return
        file.seek(0)
        if start[:2] != _GZIP:
            _follow_blocks(path, file, path.stat().st_size)
            return
        try:
            with gzip.open(file) as unpacked:
                _follow_blocks(path, unpacked, None)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise Unreadable(f"'{path}' is cut short or damaged: {error}") from error


def _follow_blocks(path: Path, file: BinaryIO | gzip.GzipFile, size: int | None) -> None:
    """Go from block to block until the one that says it is the last."""
    start = file.read(7)
    if start != b"BLENDER":
        raise Unreadable(f"'{path}' could not be read: it does not begin as Blender's files do")
    block = _block_header(file.read(5))
    if block is None:
        raise Unreadable(f"'{path}' is damaged: its first bytes name no version of Blender")
    form, pad, length_at = block
    file.seek(pad, 1)
    while True:
        header = file.read(struct.calcsize(form))
        if header[:4] == b"ENDB":
            return
        if len(header) < struct.calcsize(form):
            raise Unreadable(f"'{path}' is cut short: its last block is not there")
        length = struct.unpack(form, header)[length_at]
        end = file.tell() + length
        if length < 0 or (size is not None and end > size):
            raise cut_short(path, f"its block '{header[:4].decode('latin-1')}' goes on", end, size or 0)
        if size is None and file.seek(length, 1) < end:
            raise Unreadable(f"'{path}' is cut short: its last block is not there")
        file.seek(end)


def _block_header(version: bytes) -> tuple[str, int, int] | None:
    """Return how a block's header is packed, how many bytes of the file's own are left, and which field is the length.

    >>> _block_header(b"-v405")
    ('<4siQii', 0, 1)
    """
    order = {b"v": "<", b"V": ">"}.get(version[1:2])
    pointer = {b"_": "I", b"-": "Q"}.get(version[:1])
    if order and pointer:
        return f"{order}4si{pointer}ii", 0, 1
    if version[:3] == b"17-":  # since Blender 5.0: "17-01v0500"
        return "<4siQqq", 5, 3
    return None
