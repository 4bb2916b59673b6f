"""Attacks on bounds and certificates: whatever counts a violation is a wrong bound or a wrong value.

Run::

    uv run python tests/bench/adversarial.py [--cells 1000000] [--instances 1000] [--processes 2] [--sphere | --boxes]

A million cells, where everything is at the edge of what is allowed (tests/solver/attacks.py), go through every kind of
bound there is: swept in numpy; pairs, raster, windows and searched subtrees of each compiled library that runs here. In
each cell a transformation is known, and its value in exact arithmetic: no bound may be below it. Then searches of
planted instances, with each library and in numpy: value and bound are held against the planted value and `certify`,
some bounds against a proof by `certify`. It prints counts, and ends with 1 if there is a violation. With --sphere the
same for the search on the sphere: cells of axes (tests/solver/sphere_attacks.py); with --boxes, boxes of all its
transformations (tests/solver/box_attacks.py).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "solver")]

import attacks  # noqa: E402
import box_attacks  # noqa: E402
import sphere_attacks  # noqa: E402
from attacks import tried, violations  # noqa: E402

AT_ONCE, PROBLEMS = 200, 500
"""Cells of a problem, and problems between two lines that tell how far it is."""


def main() -> int:
    """Attack, print the counts, and return 1 if there are violations."""
    parser = argparse.ArgumentParser(description="Attacks on bounds and certificates.")
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--instances", type=int, default=1_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="number of the first problem")
    parser.add_argument("--sphere", action="store_true", help="the search on the sphere instead of the disc's")
    parser.add_argument("--boxes", action="store_true", help="the same, its boxes of all transformations")
    given = parser.parse_args()
    module = sphere_attacks if given.sphere or given.boxes else attacks
    cells = box_attacks if given.boxes else module
    total: Counter[str] = Counter()
    begun, number = time.perf_counter(), given.first
    with ProcessPoolExecutor(given.processes) as pool:
        attempt = partial(tried, attempt=partial(cells.cells_of, count=AT_ONCE))
        while total["cells"] < given.cells:
            for counts in pool.map(attempt, range(number, number + PROBLEMS), chunksize=10):
                total.update(counts)
            number += PROBLEMS
            print(f"{total['cells']:9d} cells, {time.perf_counter() - begun:.0f} s", flush=True)
        some = range(given.first, given.first + given.instances)
        for counts in pool.map(partial(tried, attempt=module.searched), some, chunksize=5):
            total.update(counts)
    for name, count in sorted(total.items()):
        print(f"{count:9d} {name}")
    wrong = sum(violations(total).values())
    print(f"{wrong:9d} violations in {time.perf_counter() - begun:.0f} s")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
