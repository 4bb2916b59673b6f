"""Many rows in a few lines: medians per set and method, and which of the targets each pair meets."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.bench.paper.tables import as_text

from .pairs import Pair
from .score import Map, Score

RIGHT_ERROR = 3.0
"""Mean error in % below which a map of a face, a brain or a bent piece is right."""

RIGHT_MARKS = 16
"""Landmark pairs of 18 that a right map of teeth brings together."""

SIMPOP_ERROR = 0.3
"""Mean error in % that the dense map is to reach on SIMPOP."""

TITLES = {
    "best-mobius": "best possible Möbius",
    "none": "**ours**, the search alone",
    "mobius": "**ours**, Möbius, all vertices",
    "dense": "**ours**, dense (the default)",
    "paper": "the paper's objective (eq. 3)",
    "oracle-nearest": "best pose there is, nearest point",
    "pose": "open3d pose, nearest point",
    "meshmonk": "open3d, meshmonk",
    "zoomout": "functional maps, ZoomOut",
}


@dataclass(frozen=True, eq=False)
class Row:
    """What one method reached on one pair."""

    pair: Pair
    method: str
    found: Map
    score: Score

    @property
    def right(self) -> bool:
        """Whether the map is the right one, however accurate."""
        if self.pair.surface is None:
            return (self.score.marks or 0) >= RIGHT_MARKS
        return self.score.mean < RIGHT_ERROR


def medians(rows: list[Row]) -> str:
    """Return the README's table, in Markdown: the median of the mean errors, and how many pairs are right."""
    methods = [name for name in TITLES if any(row.method == name for row in rows)]
    kinds = list(dict.fromkeys(row.pair.kind for row in rows))
    lines = [
        "| median error in %, pairs that are right | " + " | ".join(kinds) + " |",
        "|---" * (len(kinds) + 1) + "|",
    ]
    for name in methods:
        cells = []
        for kind in kinds:
            of = [row for row in rows if row.pair.kind == kind and row.method == name]
            right = f"{sum(row.right for row in of)} of {len(of)}"
            cells.append(f"{np.median([row.score.mean for row in of]):.2f}, {right}" if of else "")
        lines.append(f"| {TITLES[name]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def folds(rows: list[Row]) -> str:
    """Return the triangles that are turned over or collapsed, the median and the most, and what has no counterpart."""
    methods = [name for name in TITLES if any(row.method == name for row in rows)]
    table = []
    for kind in dict.fromkeys(row.pair.kind for row in rows):
        line = {"set": kind}
        for name in methods:
            of = [row.score for row in rows if row.pair.kind == kind and row.method == name]
            line[name] = ""
            if of:
                folded, left_out = [x.folded for x in of], max(x.left_out for x in of)
                line[name] = f"{np.median(folded):.2f} / {max(folded):.2f}"
                line[name] += f" ({left_out:.1f})" if left_out else ""
        table.append(line)
    return as_text(table, "Folded triangles with a counterpart, in %: median / most (the most without one)")


def targets(rows: list[Row]) -> str:
    """Return, pair by pair, which targets the last of our stages that was run meets."""
    by_pair: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        by_pair.setdefault((row.pair.kind, row.pair.name), {})[row.method] = row
    checks: dict[str, Callable[[dict[str, Row], Row], bool | None]] = {
        "right": _is_right,
        "below meshmonk": lambda all_, own: (
            own.score.mean < all_["meshmonk"].score.mean
            if own.pair.kind in ("ict", "ict-moved", "teeth") and "meshmonk" in all_
            else None
        ),
        f"at most {SIMPOP_ERROR} %": lambda _, own: (
            own.score.mean <= SIMPOP_ERROR if own.pair.kind == "simpop" and own.method == "dense" else None
        ),
        "no folds": lambda _, own: own.score.folded == 0 if own.method == "dense" else None,
        "proved": lambda _, own: own.found.facts["certified"],
        "orientation": lambda _, own: own.found.facts["reflected"] == own.pair.reflected,
    }
    table, met = [], {name: [] for name in checks}
    for (kind, name), found in by_pair.items():
        own = next((found[m] for m in ("dense", "mobius", "none") if m in found), None)
        if own is None:
            continue
        line = {"set": kind, "source > target": name}
        for check, holds in checks.items():
            result = holds(found, own)
            line[check] = {True: "yes", False: "NO", None: "-"}[result]
            met[check] += [] if result is None else [result]
        table.append(line)
    if not table:
        return ""
    total = {"set": "met", "source > target": ""} | {c: f"{sum(x)} of {len(x)}" for c, x in met.items()}
    return as_text([*table, total], "Targets, of the last of our stages that was run")


def _is_right(found: dict[str, Row], own: Row) -> bool | None:
    """Teeth whose best possible Möbius does not bring enough landmarks together ask for nothing."""
    best = found.get("best-mobius")
    if own.pair.surface is None and best is not None and not best.right:
        return None
    return own.right


def seconds(rows: list[Row]) -> str:
    """Return the median seconds per stage of ours, and what the tools took beside them."""
    table = []
    for kind in dict.fromkeys(row.pair.kind for row in rows):
        for name in dict.fromkeys(row.method for row in rows):
            of = [row.found.facts.get("seconds") for row in rows if row.pair.kind == kind and row.method == name]
            of = [x for x in of if x]
            if not of or name == "none":
                continue
            stages = list(dict.fromkeys(stage for x in of for stage in x))
            each = {stage: float(np.median([x.get(stage, 0.0) for x in of])) for stage in stages}
            total = float(np.median([sum(x.values()) for x in of]))
            most = max(sum(x.values()) for x in of)
            table.append(
                {
                    "set": kind,
                    "method": name,
                    "total": f"{total:.2f}",
                    "most": f"{most:.1f}",
                    "stages": ", ".join(f"{stage} {t:.2f}" for stage, t in each.items()),
                }
            )
    return as_text(table, "Seconds when they were first computed, medians (whatever else ran at the time)")
