"""The correspondence on real surfaces, measured against the truth, beside other methods.

    python -m tests.bench.correspondence -o FOLDER [--sets simpop,teeth,...] [--pairs K] [--methods mobius,dense,...]
                                         [--pictures]

Run from the repository's root; the data is found as the tests find it. The target of each pair is posed at random and
decimated to 70 %; every pair runs in both directions. In the sets "-moved" its vertices are moved along the surface
besides, so that it has none in common with the source's template, as two scans have none. FOLDER, outside the
repository, keeps what was computed: each result is computed again only when the pair, the method or the solver's code
has changed. Methods:

    none, mobius, dense     `align` with its default settings, after each stage
    best-mobius             the Möbius transformation fitted to the truth: the least error of that stage
    paper                   the paper's objective (eq. 3) on as many points, orientation given
    oracle-nearest          the best similarity, fitted to the truth, then the nearest point
    pose                    open3d's pose (FPFH, RANSAC, closest points), then the nearest point
    meshmonk                that pose, then meshmonk
    zoomout                 functional maps (pyfmaps) with ZoomOut
"""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from . import ours, tools
from .pairs import Pair
from .score import Map, score
from .sets import SETS
from .store import Store
from .tables import Row, folds, medians, seconds, targets

OTHERS: dict[str, Callable[[Pair, Store], Map]] = {
    "best-mobius": ours.best_mobius,
    "paper": ours.paper,
    "pose": tools.pose,
    "meshmonk": tools.meshmonk,
    "zoomout": tools.zoomout,
    "oracle-nearest": lambda pair, _: ours.oracle_nearest(pair),
}
METHODS = (*ours.STAGES, *OTHERS)


def maps(pair: Pair, methods: list[str], store: Store) -> dict[str, Map]:
    """Return what the methods find on a pair."""
    found = ours.stages(pair, methods, store)
    found |= {name: OTHERS[name](pair, store) for name in methods if name in OTHERS}
    return {name: found[name] for name in methods}


def line(row: Row) -> str:
    """Return one line of the long table."""
    pair, measured, facts = row.pair, row.score, row.found.facts
    marks = "" if measured.marks is None else f"{measured.marks:2d}/{measured.of}"
    said = []
    if measured.overlooked is not None:
        said.append(f"overlooked {measured.overlooked:.0f} %, doubted {measured.doubted:.0f} %")
    if facts.get("overlap") is not None:
        said.append(f"the overlap's {100 * facts['overlap']:.0f} % alone")
    if "certified" in facts:
        said.append("proved" if facts["certified"] else "NOT PROVED")
    if "reflected" in facts and facts["reflected"] != pair.reflected:
        said.append("WRONG SIDE")
    if facts.get("unfolded", 0) >= 0.005:
        said.append(f"{100 * facts['unfolded']:.0f} % UNBENT")
    told = ("ambiguous", "doubtful", "reconsidered", "unsure")
    said += [" ".join(w.split()[:2]).split(":")[0] for w in facts.get("warnings", ()) if w.startswith(told)]
    if facts.get("margin") is not None:
        said.append(f"side {facts['margin']:+.3f}, value {facts['value']:.1f}")
    if facts.get("rival_margin") is not None:
        said.append(f"rival {facts['rival_margin']:+.3f}")
    said.append(" ".join(f"{stage} {t:.1f}" for stage, t in facts.get("seconds", {}).items() if t >= 0.05))
    return (
        f"{pair.kind:10} {pair.name:36} {row.method:14} {measured.mean:6.2f} {measured.p95:6.2f} {marks:>6} "
        f"{measured.folded:6.2f} {measured.left_out:6.2f}  {'; '.join(said)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m tests.bench.correspondence",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for results, outside the repository")
    parser.add_argument("--sets", "--set", default="simpop,ict,teeth", help=f"of {', '.join(SETS)}, or all")
    parser.add_argument("--pairs", type=int, help="only the first so many pairs of each set")
    parser.add_argument("--methods", default="best-mobius,none,mobius", help=f"of {', '.join(METHODS)}, or all")
    parser.add_argument("--pictures", action="store_true", help="a sheet of error maps per set; wants the group bench")
    options = parser.parse_args()
    sets = list(SETS) if options.sets == "all" else options.sets.split(",")
    methods = list(METHODS) if options.methods == "all" else options.methods.split(",")
    for name, known in [(s, SETS) for s in sets] + [(m, METHODS) for m in methods]:
        if name not in known:
            parser.error(f"unknown '{name}': use {', '.join(known)}")
    store = Store(options.output / "kept")
    rows: list[Row] = []
    columns = " ".join(f"{name:>6}" for name in ("mean %", "95 %", "marks", "folds", "beyond"))
    print(f"{'set':10} {'source > target':36} {'method':14} {columns}")
    for name in sets:
        for pair in SETS[name](store, options.pairs):
            for method, found in maps(pair, methods, store).items():
                rows.append(Row(pair, method, found, score(pair, found)))
                print(line(rows[-1]), flush=True)
    tables = "\n".join([medians(rows), "", folds(rows), targets(rows), seconds(rows)])
    (options.output / "tables.txt").write_text(tables, encoding="utf-8")
    print(f"\n{tables}")
    if options.pictures:
        from . import pictures

        for name in sets:
            if some := [row for row in rows if row.pair.kind == name]:
                pictures.sheet(options.output / f"{name}.png", some)
        if any(row.found.confidence is not None for row in rows):
            pictures.confidence(options.output / "confidence.png", rows)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # Blender's module can hang in the C library's exit handlers
