"""Whether maps hang on the last digits: each pair again with its vertices moved by 1e-9 of its size.

    python -m tests.bench.stability -o FOLDER [--sets simpop,teeth,...] [--pairs K]

Prints, for each pair, how far the two maps are apart on the source: the mean, and the share of the target's vertices
whose places differ by more than `SAME` of the diagonal; and whether the same input gives the same bits. FOLDER, outside
the repository, keeps the pairs.
"""

import argparse
from pathlib import Path

import numpy as np

from solver import AlignSettings
from tests.solver.stability import SAME, apart, places

from .correspondence.sets import SETS
from .correspondence.store import Store


def main() -> None:
    """Print how stable each pair is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--pairs", type=int)
    options = parser.parse_args()
    for name in options.sets.split(","):
        for pair in SETS[name](Store(options.output / "kept"), options.pairs):
            settings = AlignSettings(fill_holes=pair.openings)
            moved = apart(pair.source, pair.target, settings)
            again = [places(pair.source, pair.target, settings) for _ in range(2)]
            same = "the same bits" if np.array_equal(*again) else "OTHER BITS"
            verdict = "stable" if moved.mean() < SAME else "NOT STABLE"
            print(
                f"{pair.kind:10} {pair.name:36} mean {moved.mean():.1e}, {100 * (moved > SAME).mean():.2f} % apart, "
                f"most {moved.max():.1e}: {verdict}, {same}",
                flush=True,
            )


if __name__ == "__main__":
    main()
