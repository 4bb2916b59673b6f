"""What a second target costs beside the first: a prepared source is not flattened, measured or sampled again.

    python -m tests.bench.second_target [SOURCE TARGET OTHER_TARGET]

Aligns targets with a source that is a mesh, and with the surface it was prepared as, in turn; prints the seconds of the
stages that concern one surface alone. Descriptors and sampling are of both surfaces. Default: faces of the data folder.
"""

import sys
from pathlib import Path

from solver import AlignSettings, align, prepare
from tests.solver.mesh_files import read_mesh

from .paper.data import DATA

STAGES = ("flatten source", "flatten target", "descriptors", "sampling")

ROUNDS = 5


def main(arguments: list[str]) -> None:
    faces = DATA / "faces_simpop"
    paths = [Path(x) for x in arguments] or [faces / f"SIMPOP_{n}.obj" for n in ("01", "10", "20")]
    source, *targets = (read_mesh(path) for path in paths)
    settings = AlignSettings(refine="mobius")
    surface = prepare(source, settings)
    runs: dict[str, list[dict[str, float]]] = {"mesh": [], "prepared": []}
    for _ in range(ROUNDS):  # in turn, so that a machine that slows down slows both
        for target in targets:
            runs["mesh"].append(align(source, target, settings).seconds)
            runs["prepared"].append(align(surface, target, settings).seconds)
    print(f"least of {ROUNDS} rounds over {len(targets)} targets, in seconds")
    print(f"{'stage':18} {'source a mesh':>15} {'prepared':>15} {'ratio':>7}")
    for stage in STAGES:
        first, second = (min(seconds[stage] for seconds in runs[kind]) for kind in ("mesh", "prepared"))
        print(f"{stage:18} {first:15.4f} {second:15.4f} {second / first:7.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
