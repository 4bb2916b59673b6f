"""What a file says of itself, compared with what it holds: a file cut short never reaches Blender's importers.

These take a header's counts on trust: they make room for all of it before they read, and may end the process. Of
coordinates that are no numbers they make zeros without a word.
"""

from __future__ import annotations

import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

import numpy as np

from . import blend_header, fbx_header, gltf_header, ply_header
from .nowhere import are_places, is_nowhere, may_be_nowhere
from .unreadable import Unreadable, cut_short, no_numbers

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])


def require_sound(path: Path) -> None:
    """Raise `Unreadable` if a file is shorter than its header says, its header makes no sense, or a point is nowhere.

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


def _check_stl(path: Path) -> None:
    """Compare the number of triangles in a binary STL file with its length; of a text, look at the last line."""
    content = path.read_bytes()
    size = len(content)
    count = struct.unpack_from("<I", content, 80)[0] if size >= 84 else 0
    need = 84 + 50 * count
    if size >= 84 and need == size:
        corners = np.frombuffer(content, _TRIANGLE, count, 84)["corners"]
        if (wrong := np.flatnonzero(~are_places(corners).all(axis=(1, 2)))).size:
            raise no_numbers(path, wrong.size, f"in triangle {wrong[0]:,}")
    elif content[:80].lstrip()[:5].lower() == b"solid" and b"\0" not in content[:4096]:
        if b"endsolid" not in content[-4096:].lower():
            raise Unreadable(f"'{path}' is cut short: it does not end with 'endsolid', as an STL text does")
        _require_numbers(path, content, b"vertex")
    elif need > size or size < 84:
        raise cut_short(path, f"its header asks for {count:,} triangles", need, size)
    else:
        raise Unreadable(
            f"'{path}' is damaged: its header asks for {count:,} triangles, {need:,} bytes, but it is {size:,} long"
        )


def _check_obj(path: Path) -> None:
    """Look for points that are nowhere; an OBJ file has no header."""
    _require_numbers(path, path.read_bytes(), b"v")


def _require_numbers(path: Path, content: bytes, keyword: bytes) -> None:
    """Raise `Unreadable` if a line that begins with a keyword has a coordinate that is no place."""
    if not may_be_nowhere(content):
        return
    lines = re.finditer(rb"(?im)^[ \t]*" + keyword + rb"[ \t]([^\r\n#]*)", content)
    wrong = [line for line in lines if any(map(is_nowhere, line[1].split()[:3]))]
    if wrong:
        line = content.count(b"\n", 0, wrong[0].start()) + 1
        raise no_numbers(path, len(wrong), f"on line {line:,}")


def _check_usd(path: Path) -> None:
    """Look into a binary USD file, or into those in an archive of some; of a text nothing is asked."""
    with path.open("rb") as file:
        start = file.read(8)
        if start == b"PXR-USDC":
            _follow_usd(path, file, path.stat().st_size)
        elif start[:4] == b"PK\3\4" or path.suffix.lower() == ".usdz":
            _check_archive(path, file)


def _check_archive(path: Path, file: IO[bytes]) -> None:
    """Look for the end of an archive, which USD itself does not need, and into what it holds."""
    try:
        with zipfile.ZipFile(file) as archive:
            for entry in archive.infolist():
                with archive.open(entry) as part:
                    if part.read(8) == b"PXR-USDC":
                        _follow_usd(path, part, entry.file_size)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError, struct.error) as error:
        raise Unreadable(f"'{path}' is cut short or damaged: it is no whole archive ({error})") from error


def _follow_usd(path: Path, file: IO[bytes], size: int) -> None:
    """Compare where the parts of a binary USD file, of so many bytes, are said to be with its length."""
    file.seek(0)
    start = file.read(88)
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
    ".fbx": fbx_header.check,
    ".glb": gltf_header.check,
    ".gltf": gltf_header.check,
    ".obj": _check_obj,
    ".ply": ply_header.check,
    ".stl": _check_stl,
    ".usd": _check_usd,
    ".usdc": _check_usd,
    ".usdz": _check_usd,
    ".vrm": gltf_header.check,
}
