"""Damaged scans: does each flaw, alone and with another, leave the map as it was, or is it refused by name?

    python -m tests.bench.damages [--count 200] [--seed 0] [--scans bumps|ict|simpop|teeth ...] [--triangles 4000]

Real scans are decimated to so many triangles first: the flaws and what is done about them are the same on fine ones,
which take longer. Prints a line for each flaw: in how many pairs it took part, alone or with another, how often the map
was the same (within 0.3 % of the diagonal), refused, doubted aloud, or another one in silence; each one that is not the
same, as it comes; and the processor's time.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "solver"))  # as pytest does: `scans` imports `surfaces`

from solver import AlignSettings, TriangleMesh
from tests.bench.correspondence.decimation import decimated
from tests.bench.paper.data import read
from tests.solver.damages import DAMAGES, Clean, Outcome
from tests.solver.scans import bumps, posed, remeshed

KINDS = ("same", "refused", "doubted", "silent")

REAL = {
    "ict": ("faces_ict/ict_M_neutral.obj", "faces_ict/ict_M_happy_level4.obj"),
    "simpop": ("faces_simpop/SIMPOP_01.obj", "faces_simpop/SIMPOP_10.obj"),
    "teeth": ("teeth/H10.obj", "teeth/H19.obj"),
}
"""Pairs of scans: two expressions, two people, two teeth of one genus."""


def pairs(names: list[str], triangles: int) -> Iterator[tuple[str, TriangleMesh, TriangleMesh]]:
    """Yield clean pairs: hilly sheets, and real scans of so many triangles."""
    if "bumps" in names:
        for seed in (2, 5, 7):
            sheet = bumps(1500, seed=seed, bend=0.8 if seed == 5 else 0.0)
            yield f"bumps {seed}", sheet, remeshed(posed(sheet, seed), 0.7, seed)[0]
    for seed, name in enumerate(REAL, 1):
        if name in names:
            source, target = (read(path) for path in REAL[name])
            source, target = (decimated(mesh, min(1.0, triangles / len(mesh.faces))) for mesh in (source, target))
            yield name, source, posed(target, seed)


def drawn(count: int, seed: int) -> Iterator[tuple[tuple[int, ...], str, int]]:
    """Yield flaws by number, each alone first and then pairs at random, and which side has them."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        number = k % len(DAMAGES)
        alone = k < len(DAMAGES)
        others = [x for x in range(len(DAMAGES)) if x != number]
        chosen = (number,) if alone else tuple(rng.permutation([number, int(rng.choice(others))]).tolist())
        yield chosen, str(rng.choice(["source", "target"])), int(rng.integers(1 << 30))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scans", nargs="+", default=["bumps"])
    parser.add_argument("--triangles", type=int, default=4000)
    options = parser.parse_args()
    settings = AlignSettings(time_limit=None)
    clean = [
        (name, Clean(source, target, settings)) for name, source, target in pairs(options.scans, options.triangles)
    ]
    found: list[tuple[tuple[int, ...], Outcome]] = []
    for k, (chosen, side, seed) in enumerate(drawn(options.count, options.seed)):
        name, pair = clean[k % len(clean)]
        outcome = pair.outcome([DAMAGES[x] for x in chosen], side, seed)
        found.append((chosen, outcome))
        print(f"{k + 1} of {options.count}", end="\r", file=sys.stderr, flush=True)
        if outcome.kind != "same":
            flaws = " + ".join(DAMAGES[x].__name__ for x in chosen)
            print(
                f"{name}, {side}, seed {seed}: {flaws}: {outcome.kind}, {outcome.error:.2f} %: {outcome.text}",
                flush=True,
            )
    print(f"\n{'flaw':<22}{'pairs':>7}" + "".join(f"{kind:>9}" for kind in KINDS) + f"{'worst same %':>14}")
    for number, damage in enumerate(DAMAGES):
        own = [outcome for chosen, outcome in found if number in chosen]
        counts = "".join(f"{sum(x.kind == kind for x in own):>9}" for kind in KINDS)
        worst = max((x.error for x in own if x.kind == "same"), default=float("nan"))
        print(f"{damage.__name__:<22}{len(own):>7}{counts}{worst:>14.3f}")
    total = "".join(f"{sum(x.kind == kind for _, x in found):>9}" for kind in KINDS)
    print(f"{'all':<22}{len(found):>7}{total}\n{time.process_time():.0f} s of the processor")


if __name__ == "__main__":
    main()
