"""Tables as text for people and as CSV for programs."""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

Rows = list[dict[str, Any]]


def write_csv(path: Path, rows: Rows) -> None:
    """Write every row, in the columns of the first and any more that others have."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


def averaged(rows: Rows, by: Iterable[str], mean: Iterable[str]) -> Rows:
    """Return one row for each combination of the `by` columns, in order of appearance, with means of the others."""
    by, mean = list(by), list(mean)
    groups: dict[tuple[Any, ...], Rows] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in by), []).append(row)
    return [
        dict(zip(by, key, strict=True)) | {name: float(np.mean([float(row[name]) for row in group])) for name in mean}
        for key, group in groups.items()
    ]


def as_text(rows: Rows, title: str) -> str:
    """Return an aligned table; numbers to the right, four digits."""

    def cell(value: Any) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, float):
            return f"{value:.0f}" if value == round(value) and abs(value) < 1e6 else f"{value:.4g}"
        return str(value)

    columns = list(dict.fromkeys(key for row in rows for key in row))
    cells = [columns] + [[cell(row.get(key, "")) for key in columns] for row in rows]
    width = [max(len(line[k]) for line in cells) for k in range(len(columns))]
    left = [isinstance(next((row[key] for row in rows if key in row), ""), str) for key in columns]
    lines = [
        "  ".join(
            x.ljust(w) if to_left else x.rjust(w) for x, w, to_left in zip(line, width, left, strict=True)
        ).rstrip()
        for line in cells
    ]
    return "\n".join([title, "", *lines, ""])
