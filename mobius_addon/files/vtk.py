"""Reading .vtk files: surfaces in VTK's legacy format, as text or binary, of the versions from 2 to 5.1."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...solver.surface.mesh import Integers
from .polygons import Polygons, put_into_scene
from .unreadable import Unreadable, cut_short

_TYPES = {
    "char": "i1",
    "unsigned_char": "u1",
    "short": "i2",
    "unsigned_short": "u2",
    "int": "i4",
    "unsigned_int": "u4",
    "vtkidtype": "i4",  # always written as int
    "long": "i8",
    "unsigned_long": "u8",
    "vtktypeint64": "i8",
    "vtktypeint32": "i4",
    "float": "f4",
    "double": "f8",
}
_TRIANGLE, _POLYGON, _QUAD = 5, 7, 9


class _Content:
    """What is left of a file from a place on: lines of words, and numbers between them."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._bytes = path.read_bytes()
        self.place = 0
        version, _title, form = (self._line() for _ in range(3))
        if not version.startswith("# vtk DataFile"):
            raise Unreadable(f"'{path}' could not be read: it does not begin as VTK's legacy files do")
        if form.strip().upper() not in ("ASCII", "BINARY"):
            raise Unreadable(f"'{path}' is damaged: its third line is neither ASCII nor BINARY")
        self._text = form.strip().upper() == "ASCII"

    def _line(self) -> str:
        end = self._bytes.find(b"\n", self.place)
        end = len(self._bytes) if end < 0 else end
        line = self._bytes[self.place : end]
        self.place = end + 1
        return line.decode("latin-1")

    def words(self) -> list[str]:
        """Return the words of the next line that is not empty; none at the end."""
        while self.place < len(self._bytes):
            if words := self._line().split():
                return words
        return []

    def skip_remarks(self) -> None:
        """Go past what newer versions say about the numbers before, up to an empty line."""
        while self.place < len(self._bytes) and self._line().strip():
            pass

    def numbers(self, count: int, kind: str) -> np.ndarray:
        """Return the next numbers, (count,)."""
        form = _TYPES.get(kind.lower())
        if form is None:
            raise Unreadable(f"'{self.path}' could not be read: it has numbers of the unknown type '{kind}'")
        left = len(self._bytes) - self.place
        # in a text each is at least a digit and a blank, which the last may lack
        need = 2 * count - 1 if self._text else count * np.dtype(form).itemsize
        if count < 0 or need > left:
            raise cut_short(self.path, f"its header asks for {count:,} numbers", need, max(left, 0))
        if not self._text:
            values = np.frombuffer(self._bytes, f">{form}", count, self.place)
            self.place += need
            return values
        words: list[str] = []
        while len(words) < count:
            if not (line := self.words()):
                raise Unreadable(f"'{self.path}' is cut short: it ends after {len(words):,} of {count:,} numbers")
            words += line
        try:
            return np.array(words[:count]).astype(np.float64 if form[0] == "f" else np.int64)
        except (ValueError, OverflowError) as error:
            raise Unreadable(f"'{self.path}' is damaged: {error}") from error


def read(path: str) -> None:
    """Put the surface of a VTK file into the scene; values on it are left out.

    Raises
    ------
    Unreadable
        It is none, or damaged.
    """
    content = _Content(Path(path))
    points, types, kind = np.empty((0, 3)), None, ""
    cells: dict[str, tuple[Integers, Integers]] = {}
    while words := content.words():
        keyword = words[0].upper()
        try:
            if keyword == "DATASET":
                kind = words[1].upper()
            elif keyword == "METADATA":
                content.skip_remarks()
            elif keyword == "POINTS":
                points = content.numbers(3 * int(words[1]), words[2]).reshape(-1, 3)
            elif keyword in ("VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS"):
                cells[keyword] = _cells(content, int(words[1]), int(words[2]))
            elif keyword == "CELL_TYPES":
                types = content.numbers(int(words[1]), "int")
            elif keyword in ("POINT_DATA", "CELL_DATA"):
                break
        except (IndexError, ValueError) as error:
            raise Unreadable(f"'{path}' is damaged: '{' '.join(words)[:60]}' is not understood") from error
    if kind not in ("POLYDATA", "UNSTRUCTURED_GRID"):
        raise Unreadable(f"'{path}' holds no surface (POLYDATA) but '{kind[:40]}'")
    surface = [cells["POLYGONS"]] if "POLYGONS" in cells else []
    if "TRIANGLE_STRIPS" in cells:
        surface.append(_without_strips(*cells["TRIANGLE_STRIPS"]))
    if "CELLS" in cells:
        surface.append(_flat_cells(path, *cells["CELLS"], types))
    corners = np.concatenate([x[0] for x in surface]) if surface else np.empty(0, np.intp)
    sizes = np.concatenate([x[1] for x in surface]) if surface else np.empty(0, np.intp)
    put_into_scene(Polygons(points.astype(np.float64), corners, sizes), Path(path))


def _cells(content: _Content, first: int, second: int) -> tuple[Integers, Integers]:
    """Return the vertices of all cells, and how many each has."""
    place = content.place
    following = content.words()
    if following[:1] == ["OFFSETS"]:  # since version 5.0: where each begins, and the end
        offsets = content.numbers(first, following[1]).astype(np.intp)
        following = content.words()
        if following[:1] != ["CONNECTIVITY"]:
            raise ValueError("no CONNECTIVITY")
        corners = content.numbers(second, following[1]).astype(np.intp)
        sizes = np.diff(offsets)
        if len(offsets) and (offsets[0] != 0 or (sizes < 0).any() or offsets[-1] != len(corners)):
            raise ValueError("offsets that do not fit")
        return corners, sizes
    content.place = place
    # each cell is its size and its vertices
    numbers = content.numbers(second, "int").astype(np.intp)
    starts, at = np.empty(first, np.intp), 0
    for cell in range(first):
        starts[cell] = at
        if at >= len(numbers) or numbers[at] < 0:
            raise ValueError("sizes that do not fit")
        at += 1 + int(numbers[at])
    if at != len(numbers):
        raise ValueError("sizes that do not fit")
    kept = np.ones(len(numbers), bool)
    kept[starts] = False
    return numbers[kept], numbers[starts]


def _without_strips(corners: Integers, sizes: Integers) -> tuple[Integers, Integers]:
    """Return strips as triangles, every other one turned round so that all have the side of the first."""
    triangles = []
    for strip in np.split(corners, np.cumsum(sizes)[:-1]):
        three = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
        three[1::2] = three[1::2][:, [1, 0, 2]]
        triangles.append(three)
    result = np.concatenate(triangles) if triangles else np.empty((0, 3), np.intp)
    return result.ravel(), np.full(len(result), 3)


def _flat_cells(path: str, corners: Integers, sizes: Integers, types: Integers | None) -> tuple[Integers, Integers]:
    """Return those cells of a grid that are polygons."""
    if types is None or len(types) != len(sizes):
        raise Unreadable(f"'{path}' is damaged: its cells and their types are not equally many")
    flat = np.isin(types, (_TRIANGLE, _POLYGON, _QUAD))
    if not flat.any():
        raise Unreadable(f"'{path}' holds no surface: its cells are no triangles, quads or polygons")
    return corners[np.repeat(flat, sizes)], sizes[flat]
