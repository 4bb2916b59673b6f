"""Reading .off files (Geomview's, and CGAL's with their colors and normals)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .polygons import Polygons, put_into_scene
from .unreadable import Unreadable

_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF\b")


def read(path: str) -> None:
    """Put the mesh of an OFF file into the scene; what it says of colors, normals and textures is left out.

    Raises
    ------
    Unreadable
        It is none, or damaged.
    """
    file = Path(path)
    # the line of the file on which each of these stands is lost with remarks and empty lines, so it is kept
    lines = [
        (number, words)
        for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if (words := line.partition("#")[0].split())
    ]
    keyword = _KEYWORD.match(lines[0][1][0]) if lines else None
    if keyword:
        if keyword[4] or keyword[5]:
            raise Unreadable(f"'{path}' could not be read: its points have more than three coordinates")
        lines[0] = lines[0][0], lines[0][1][1:]
        if lines[0][1][:1] == ["BINARY"]:
            raise Unreadable(f"'{path}' could not be read: it is a binary OFF file; save it as text")
        if not lines[0][1]:
            del lines[0]
    try:
        vertices, faces = (int(word) for word in lines[0][1][:2])
    except (IndexError, ValueError):
        raise Unreadable(f"'{path}' could not be read: it does not begin with OFF and the number of points") from None
    if vertices < 0 or faces < 0 or vertices + faces > len(lines) - 1:
        raise Unreadable(
            f"'{path}' is cut short or damaged: its header asks for {vertices:,} points and {faces:,} polygons, "
            f"but {len(lines) - 1:,} lines follow"
        )
    points = np.array([_row(file, line, 3, float) for line in lines[1 : vertices + 1]], np.float64).reshape(-1, 3)
    rows = [
        _row(file, (number, words[1:]), _row(file, (number, words), 1, int)[0], int)
        for number, words in lines[vertices + 1 : vertices + 1 + faces]
    ]
    sizes = np.array([len(row) for row in rows], np.intp)
    put_into_scene(Polygons(points, np.array([v for row in rows for v in row], np.intp), sizes), file)


def _row(path: Path, line: tuple[int, list[str]], count: float, kind: type[float]) -> list[float]:
    """Return the first numbers of a line."""
    number, words = line
    try:
        values = [kind(word) for word in words[: int(count)]]
    except ValueError:
        values = []
    if len(values) != count:
        raise Unreadable(f"'{path}', line {number}, is damaged: '{' '.join(words)[:60]}' are not {count} numbers")
    return values
