"""What a file says of itself, compared with what it holds: a file cut short never reaches Blender's importers.

These take a header's counts on trust: they make room for all of it before they read, and may end the process.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path

from . import blend_header, gltf_header
from .unreadable import Unreadable, cut_short

_PLY_SIZES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "float", "int32", "uint32", "float32"), 4),
    **dict.fromkeys(("double", "float64"), 8),
}
_LONGEST_HEADER = 1 << 20
"""Bytes in which the header of a PLY file ends; those with a thousand comments have a tenth of it."""


def require_sound(path: Path) -> None:
    """Raise `Unreadable` if a file is shorter than its header says, or its header says nothing that can be.

    Parameters
    ----------
    path : Path
        A file, not empty; of a kind without a header nothing is asked.
    """
    check = _CHECKS.get(path.suffix.lower())
    if check is None:
        return
    try:
        check(path)
    except OSError as error:
        raise Unreadable(f"'{path}' cannot be read: {error.strerror or error}") from error


def _check_ply(path: Path) -> None:
    """Compare what the elements of a PLY file take at the least with what follows its header."""
    with path.open("rb") as file:
        start = file.read(_LONGEST_HEADER)
    size = path.stat().st_size
    # \s takes all three kinds of line ends
    end = re.search(rb"(?:\A|[\r\n])end_header[ \t]*(?:\r\n|\r|\n|\Z)", start)
    if not start.startswith(b"ply") or end is None:
        raise Unreadable(f"'{path}' could not be read: it does not begin with the header of a PLY file")
    ascii_text, elements = True, []
    for line in re.split(r"[\r\n]+", start[: end.start() + 1].decode("latin-1")):
        words = line.split()
        if words[:1] == ["format"]:
            ascii_text = words[1:2] == ["ascii"]
        elif words[:1] == ["element"] and len(words) == 3:
            if not words[2].isdecimal():
                raise Unreadable(f"'{path}' could not be read: its header asks for '{words[2]}' of '{words[1]}'")
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"] and len(words) >= 3 and elements:
            # of a list there is at least its length
            elements[-1][2].append(words[2] if words[1] == "list" else words[1])
    need = 0
    for _, count, kinds in elements:
        # in a text every value is a digit and a blank
        row = 2 * len(kinds) if ascii_text else sum(_PLY_SIZES.get(kind, 1) for kind in kinds)
        need += count * max(row, 1)
    if ascii_text and need:
        need -= 1  # the last blank may be missing
    if need > size - end.end():
        asked = " and ".join(f"{count:,} of '{name}'" for name, count, _ in elements)
        raise cut_short(path, f"its header asks for {asked}", need, size - end.end())


def _check_stl(path: Path) -> None:
    """Compare the number of triangles in a binary STL file, or the last line of a text, with the file's length."""
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(84)
        file.seek(max(0, size - 4096))
        end = file.read()
    count = struct.unpack_from("<I", start, 80)[0] if len(start) == 84 else 0
    need = 84 + 50 * count
    if len(start) == 84 and need == size:
        return
    if start.lstrip()[:5].lower() == b"solid" and b"\0" not in start + end:
        if b"endsolid" not in end.lower():
            raise Unreadable(f"'{path}' is cut short: it does not end with 'endsolid', as an STL text does")
    elif need > size or len(start) < 84:
        raise cut_short(path, f"its header asks for {count:,} triangles", need, size)
    else:
        raise Unreadable(
            f"'{path}' is damaged: its header asks for {count:,} triangles, {need:,} bytes, but it is {size:,} long"
        )


def _check_fbx(path: Path) -> None:
    """Follow the outermost records of a binary FBX file, each of which says where it ends."""
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(27)
        if start[:20] != b"Kaydara FBX Binary  ":
            return  # a text, which Blender refuses with a sentence of its own
        if len(start) < 27:
            raise cut_short(path, "it ends in its header", 27, size)
        form = "<I" if struct.unpack_from("<I", start, 23)[0] < 7500 else "<Q"
        place = 27
        while True:
            file.seek(place)
            field = file.read(struct.calcsize(form))
            if len(field) < struct.calcsize(form):
                raise cut_short(path, "its last record is not there", place + struct.calcsize(form), size)
            following = struct.unpack(form, field)[0]
            if following == 0:
                return
            if following > size:
                raise cut_short(path, "one of its records goes on", following, size)
            if following <= place:
                raise Unreadable(f"'{path}' is damaged: a record at byte {place:,} ends at byte {following:,}")
            place = following


def _check_usd(path: Path) -> None:
    """Compare where the parts of a binary USD file are said to be with the file's length."""
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(88)
        if start[:8] != b"PXR-USDC":
            return  # a text or an archive
        if len(start) < 88:
            raise cut_short(path, "it ends in its header", 88, size)
        contents = struct.unpack_from("<q", start, 16)[0]
        if not 0 < contents <= size - 8:
            raise cut_short(path, f"its table of contents is at byte {contents:,}", contents + 8, size)
        file.seek(contents)
        count = struct.unpack("<Q", file.read(8))[0]
        if contents + 8 + 32 * count > size:
            raise cut_short(path, f"it has {count:,} parts", contents + 8 + 32 * count, size)
        for _ in range(count):
            name, begin, length = struct.unpack("<16sqq", file.read(32))
            if begin < 0 or length < 0 or begin + length > size:
                called = name.rstrip(b"\0").decode("ascii", "replace")
                raise cut_short(path, f"its part '{called}' begins at byte {begin:,}", begin + length, size)


_CHECKS: dict[str, Callable[[Path], None]] = {
    ".blend": blend_header.check,
    ".fbx": _check_fbx,
    ".glb": gltf_header.check,
    ".gltf": gltf_header.check,
    ".ply": _check_ply,
    ".stl": _check_stl,
    ".usd": _check_usd,
    ".usdc": _check_usd,
    ".vrm": gltf_header.check,
}
