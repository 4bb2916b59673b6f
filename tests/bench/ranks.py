"""How alike counterparts are: where `compatible`, the share of the target that a source point may match, comes from.

    python -m tests.bench.ranks -o FOLDER [--sets simpop,teeth,...]

For each source sample of a pair whose correspondence is known: which share of the target's samples is more like it than
the one next to its true place. Prints how many times likelier than by chance that share is, in bins, and how much of
the truth lies below each bin's end. A pair of descriptors tells something for the truth while this exceeds 1.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from solver import AlignSettings
from solver.align.surfaces.objective import interior, source_points
from solver.surface.descriptors import diffused_curvatures
from solver.surface.sampling import farthest_points
from solver.surface.statistics import standardised

from .correspondence.pairs import Pair
from .correspondence.sets import SETS
from .correspondence.store import Store

ENDS = np.array([0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1])

NEAR = 0.03
"""Share of the diagonal within which a sample needs a point whose counterpart is known."""


def ranks(pair: Pair) -> np.ndarray:
    """Return the share of the target's samples that is more like each source sample than its true counterpart, (k,)."""
    settings, source, target = AlignSettings(), *pair.flat
    here, there = (standardised(diffused_curvatures(x.mesh), x.mesh.vertex_areas) for x in (source, target))
    samples = source_points(source, here, settings.samples)
    others = farthest_points(target.mesh, settings.targets, np.empty(0, np.intp), interior(target))
    distance, point = KDTree(pair.known.truth).query(pair.source.vertices[samples])
    known = distance < NEAR * pair.source.diagonal
    place = pair.known.carried(pair.target, pair.target.vertices)[point[known]]
    true = np.asarray(KDTree(pair.target.vertices[others]).query(place)[1])
    apart = np.linalg.norm(here[samples[known]][:, None] - there[others], axis=2)
    return (apart < apart[np.arange(len(true)), true][:, None]).mean(axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m tests.bench.ranks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="a folder outside the repository")
    parser.add_argument("--sets", default="simpop,ict,teeth,hard-teeth,brain,bent,partial")
    options = parser.parse_args()
    store = Store(options.output)
    rows = {}
    for name in options.sets.split(","):
        found = [ranks(pair) for pair in SETS[name](store, None)]
        if found:
            rows[name] = np.concatenate(found)
    print("share of the target   " + " ".join(f"{end:6.2f}" for end in ENDS[1:]))
    for name, rank in rows.items():
        share = np.histogram(rank, ENDS)[0] / len(rank)
        print(f"{name:12} likelier " + " ".join(f"{x:6.2f}" for x in share / np.diff(ENDS)))
        print(f"{len(rank):7} truth below " + " ".join(f"{x:6.2f}" for x in np.cumsum(share)))


if __name__ == "__main__":
    main()
