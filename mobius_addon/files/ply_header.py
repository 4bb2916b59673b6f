"""Whether a PLY file holds what its header asks for, and its faces only vertices that are there.

Blender's importer ends the process where they are not.
"""

from __future__ import annotations

import re
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...solver.surface.mesh import Integers
from .nowhere import are_places, is_nowhere, may_be_nowhere
from .unreadable import Unreadable, cut_short, no_numbers

_LETTERS = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_VERTICES = ("vertex_indices", "vertex_index")
_AXES = ("x", "y", "z")


@dataclass
class _Element:
    """A kind of thing in the file, how many there are, and what each has: (name, type, type of a list's length)."""

    name: str
    count: int
    properties: list[tuple[str, str, str | None]] = field(default_factory=list)

    @property
    def least(self) -> str:
        """What one takes at the least, as `struct` says it: of a list there is its length."""
        return "".join(length or kind for _, kind, length in self.properties)


def check(path: Path) -> None:
    """Raise `Unreadable` if a PLY file is cut short, or a face or an edge has a vertex that is not there."""
    content = path.read_bytes()
    # \s and the like take all three kinds of line ends
    end = re.search(rb"[\r\n]end_header[ \t]*(?:\r\n|\r|\n|\Z)", content)
    if not content.startswith(b"ply") or end is None:
        raise Unreadable(f"'{path}' could not be read: it does not begin with the header of a PLY file")
    order, elements = _header(path, content[: end.start()])
    body = content[end.end() :]
    # in a text every value is a digit and a blank, which the last may lack
    need = sum(x.count * max(1, struct.calcsize("=" + x.least) if order else 2 * len(x.least)) for x in elements)
    need -= not order and need > 0
    if need > len(body):
        asked = " and ".join(f"{x.count:,} of '{x.name}'" for x in elements)
        raise cut_short(path, f"its header asks for {asked}", need, len(body))
    vertices = next((x.count for x in elements if x.name == "vertex"), 0)
    if wrong := (_nowhere_in_binary if order else _nowhere_in_text)(body, order, elements):
        raise no_numbers(path, len(wrong), f"vertex {wrong[0]:,}")
    if any(x.name == "face" and x.count and not _joins(x) for x in elements):
        raise Unreadable(f"'{path}' is damaged: its faces have no list of vertices ({' or '.join(_VERTICES)})")
    try:
        for found in _binary(body, order, elements) if order else _text(body, elements):
            if found.size and (found.min() < 0 or found.max() >= vertices):
                wrong = found[(found < 0) | (found >= vertices)][0]
                raise Unreadable(f"'{path}' is damaged: it joins vertex {wrong:,}, but there are {vertices:,}, from 0")
    except (IndexError, OverflowError, ValueError, struct.error) as error:
        raise Unreadable(f"'{path}' is cut short or damaged: its faces or edges cannot be read ({error})") from error


def _header(path: Path, content: bytes) -> tuple[str, list[_Element]]:
    """Return the byte order, empty for text, and the elements."""
    order, elements = None, []
    # other blanks than these stay in their words, as in Blender's importer
    for line in re.split(r"[\r\n]+", content.decode("ascii", "replace"))[1:]:
        match re.split(r"[ \t]+", line.strip(" \t")):
            case [""] | ["comment" | "obj_info", *_]:
                continue
            case ["format", form, _] if form in _ORDERS:
                order = _ORDERS[form]
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count)))
            case ["property", "list", length, kind, name] if {length, kind} <= _LETTERS.keys() and elements:
                elements[-1].properties.append((name, _LETTERS[kind], _LETTERS[length]))
            case ["property", kind, name] if kind in _LETTERS and elements:
                elements[-1].properties.append((name, _LETTERS[kind], None))
            case _:
                raise Unreadable(f"'{path}' is damaged: its header says '{line.strip()[:60]}', which PLY does not know")
    if order is None or not elements:
        raise Unreadable(f"'{path}' is damaged: its header does not say what it holds")
    return order, elements


def _joins(element: _Element) -> list[int]:
    """Return which properties of an element are numbers of vertices."""
    if element.name == "face":
        return [k for k, (name, _, length) in enumerate(element.properties) if length and name in _VERTICES]
    if element.name == "edge":
        return [k for k, (name, _, length) in enumerate(element.properties) if not length and name.startswith("vertex")]
    return []


def _nowhere_in_binary(body: bytes, order: str, elements: list[_Element]) -> list[int]:
    """Return the vertices whose coordinates are no numbers, if they come first and have no lists, as in all scans."""
    element = elements[0]
    if element.name != "vertex" or any(length for _, _, length in element.properties):
        return []
    form = np.dtype([(f"{name} {k}", order + kind) for k, (name, kind, _) in enumerate(element.properties)])
    rows = np.frombuffer(body, form, element.count)
    there = np.ones(element.count, bool)
    for name in form.names or ():
        if name.split()[0] in _AXES:
            there &= are_places(rows[name])
    return np.flatnonzero(~there).tolist()


def _nowhere_in_text(body: bytes, _order: str, elements: list[_Element]) -> list[int]:
    """Return the vertices whose coordinates are no numbers, if they come first."""
    element = elements[0]
    columns = [k for k, (name, _, _) in enumerate(element.properties) if name in _AXES]
    if element.name != "vertex" or not may_be_nowhere(body):
        return []
    return [
        k
        for k, line in enumerate(body.splitlines()[: element.count])
        if any(is_nowhere(word) for j, word in enumerate(line.split()) if j in columns)
    ]


def _binary(body: bytes, order: str, elements: list[_Element]) -> Iterator[Integers]:
    """Yield the numbers of vertices in all faces and edges."""
    place = 0
    for element in elements:
        joins = _joins(element)
        if not any(length for _, _, length in element.properties):
            size = struct.calcsize("=" + element.least)
            for k in joins:
                skipped = struct.calcsize("=" + element.least[:k])
                form = np.dtype(
                    {"names": ["v"], "formats": [order + element.least[k]], "offsets": [skipped], "itemsize": size}
                )
                yield np.frombuffer(body, form, element.count, place)["v"].astype(np.intp)
            place += element.count * size
            continue
        uniform = _rows_of_one_size(body, place, order, element)
        if uniform is not None:
            place += uniform.nbytes
            yield from (uniform[f"p{k}"].ravel().astype(np.intp) for k in joins)
            continue
        found, place = _rows_of_any_size(body, place, order, element, joins)
        yield found


def _rows_of_any_size(body: bytes, place: int, order: str, element: _Element, joins: list[int]) -> tuple[Integers, int]:
    """Return the numbers of vertices in all rows of an element, and where it ends."""
    starts: dict[tuple[str, int], list[int]] = {}
    sizes = [
        (k in joins, kind, struct.calcsize("=" + kind), length)
        for k, (_, kind, length) in enumerate(element.properties)
    ]
    for _ in range(element.count):
        for joined, kind, size, length in sizes:
            count = 1
            if length == "B":  # in all scans, and quick
                count, place = body[place], place + 1
            elif length:
                count = struct.unpack_from(order + length, body, place)[0]
                place += struct.calcsize("=" + length)
            if joined and count:
                starts.setdefault((kind, count), []).append(place)
            if count < 0:
                raise ValueError("a list has a length below 0")
            place += count * size
    if place > len(body):
        raise ValueError("a list goes on beyond the end")
    content = np.frombuffer(body, np.uint8)
    found = [np.empty(0, np.intp)]
    for (kind, count), places in starts.items():
        form = np.dtype(order + kind)
        rows = content[np.array(places)[:, None] + np.arange(count * form.itemsize)]
        found.append(rows.view(form).ravel().astype(np.intp))
    return np.concatenate(found), place


def _rows_of_one_size(body: bytes, place: int, order: str, element: _Element) -> np.ndarray | None:
    """Return the rows of an element whose lists are all as long as those of the first row, or None."""
    fields, at = [], place
    for k, (_, kind, length) in enumerate(element.properties):
        count = 1
        if length and element.count:
            count = struct.unpack_from(order + length, body, at)[0]
            fields.append((f"n{k}", order + length))
            at += struct.calcsize("=" + length)
        fields.append((f"p{k}", order + kind, (max(count, 0),)))
        at += max(count, 0) * struct.calcsize("=" + kind)
        if at > len(body):
            raise ValueError("a list goes on beyond the end")
    form = np.dtype(fields)
    if form.itemsize * element.count > len(body) - place:
        return None
    rows = np.frombuffer(body, form, element.count, place)
    same = all((rows[name] == rows[name][:1]).all() for name in form.names or () if name[0] == "n")
    return rows if same else None


def _text(body: bytes, elements: list[_Element]) -> Iterator[Integers]:
    """Yield the numbers of vertices in all faces and edges."""
    lines = body.splitlines()
    place = 0
    for element in elements:
        joins, rows = _joins(element), lines[place : place + element.count]
        if len(rows) < element.count:
            raise ValueError(f"{element.count:,} of '{element.name}' are asked for, {len(rows):,} lines are left")
        place += element.count
        if not joins or not rows:
            continue
        uniform = _columns(rows, element)
        if uniform is not None:
            yield uniform[:, 1:].astype(np.intp).ravel()
            continue
        found: list[int] = []
        for row in rows:
            words, at = row.split(), 0
            for k, (_, _, length) in enumerate(element.properties):
                count = 1
                if length:
                    count, at = int(words[at]), at + 1
                if count < 0 or at + count > len(words):
                    raise ValueError(f"'{row[:40].decode('latin-1')}' has too few numbers")
                if k in joins:
                    found += map(int, words[at : at + count])
                at += count
        yield np.array(found, np.intp)


def _columns(rows: list[bytes], element: _Element) -> np.ndarray | None:
    """Return the numbers of an element's lines, if it has one list and that is as long on each line; else None."""
    width = len(rows[0].split())
    if len(element.properties) != 1 or element.properties[0][2] is None:
        return None
    # a number that is none ends what is read
    with warnings.catch_warnings(action="ignore"):
        values = np.fromstring(b" ".join(rows), sep=" ")
    if values.size != width * len(rows) or not np.isfinite(values).all():
        return None
    table = values.reshape(-1, width)
    return table if (table[:, 0] == width - 1).all() and (np.abs(table) < 2**53).all() else None
