"""Landmarks of many specimens, as the programs of morphometrics read and write them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

from ...solver.collection.shapes import Marks
from ...solver.surface.mesh import Booleans, Floats
from ..files import Unreadable


def read_marks(path: Path) -> tuple[list[str], Floats]:
    """Return labels and places, (l, 3), of landmarks in a file.

    3D Slicer's .mrk.json (the first list in it, its numbers as they are), or a text file with one landmark on each
    line: x y z, or a label and x y z, separated by commas, semicolons or spaces; # begins a remark, and a first line of
    words alone is a heading.

    Raises
    ------
    Unreadable
        It cannot be read, or holds no landmarks.
    """
    if not path.is_file():
        raise Unreadable(f"'{path}' is not a file" if path.exists() else f"there is no file '{path}'")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise Unreadable(f"'{path}' cannot be read: {error}") from error
    labels, places = _from_json(path, text) if path.suffix.lower() == ".json" else _from_lines(path, text)
    if not places:
        raise Unreadable(f"'{path}' holds no landmarks")
    found = np.array(places, np.float64)
    if not np.isfinite(found).all():
        raise Unreadable(f"'{path}': landmark '{labels[int(np.argmax(~np.isfinite(found).all(axis=1)))]}' is nowhere")
    return labels, found


def _from_json(path: Path, text: str) -> tuple[list[str], list[list[float]]]:
    try:
        points = json.loads(text)["markups"][0]["controlPoints"]
        placed = [point for point in points if point.get("positionStatus", "defined") == "defined"]
        labels = [str(point.get("label") or number) for number, point in enumerate(placed, 1)]
        return labels, [[float(x) for x in point["position"]] for point in placed]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        raise Unreadable(f"'{path}' is no list of points as 3D Slicer writes them") from error


def _from_lines(path: Path, text: str) -> tuple[list[str], list[list[float]]]:
    labels: list[str] = []
    places: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            place = [float(word) for word in words[-3:]]
        except ValueError:
            if not places:
                continue  # a heading
            place = []
        if len(place) != 3:
            raise Unreadable(f"'{path}', line {number}: give x y z, or a label and x y z")
        labels.append(" ".join(words[:-3]) or str(len(labels) + 1))
        places.append(place)
    return labels, places


def write_markups(path: Path, labels: list[str], places: Floats, known: Booleans) -> None:
    """Write the landmarks of one specimen, (l, 3), as 3D Slicer reads them; those not known, (l,), as missing."""
    points = [
        {
            "id": str(number),
            "label": label,
            "description": "",
            "associatedNodeID": "",
            "position": [float(x) for x in place],
            "orientation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            "selected": True,
            "locked": False,
            "visibility": True,
            "positionStatus": "defined" if has else "missing",
        }
        for number, (label, place, has) in enumerate(zip(labels, places, known, strict=True), 1)
    ]
    schema = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    data = {
        "@schema": f"{schema}markups-schema-v1.0.3.json#",
        "markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}],
    }
    path.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def write_csv(path: Path, marks: Marks) -> None:
    """Write a line per specimen and landmark, without numbers where it is missing."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["specimen", "landmark", "x", "y", "z"])
        for name, places in zip(marks.names, _numbers(marks, ""), strict=True):
            rows.writerows([name, label, *place] for label, place in zip(marks.labels, places, strict=True))


def write_tps(path: Path, marks: Marks) -> None:
    """Write Rohlf's TPS in three dimensions, as tpsSuper and geomorph's readland.tps read it; NA: missing."""
    blocks = []
    for name, places in zip(marks.names, _numbers(marks, "NA"), strict=True):
        lines = [f"LM3={len(places)}", *map(" ".join, places), f"ID={name}"]
        blocks.append("\n".join(lines))
    path.write_text("\n\n".join(blocks) + "\n", encoding="utf-8")


def write_morphologika(path: Path, marks: Marks) -> None:
    """Write the format of Morphologika, as geomorph's read.morphologika reads it; NA where one is missing."""
    count, number = marks.places.shape[:2]
    lines = ["[individuals]", str(count), "[landmarks]", str(number), "[dimensions]", "3", "[names]"]
    # a name is a word there
    lines += ["_".join(name.split()) for name in marks.names]
    lines.append("[rawpoints]")
    for name, places in zip(marks.names, _numbers(marks, "NA"), strict=True):
        lines += [f"'{name}", *map(" ".join, places)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _numbers(marks: Marks, missing: str) -> list[list[list[str]]]:
    """Return the coordinates of all landmarks as texts, by specimen and landmark."""
    numbers = np.vectorize("{:.9g}".format, otypes=[object])(marks.places)
    return np.where(marks.known[:, :, None], numbers, missing).tolist()
