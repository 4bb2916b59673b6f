"""How long `align` takes: by the size of the surfaces, and for pairs in doubt beside pairs of that size that are not.

    python -m tests.bench.sizes -o FOLDER [--triangles 15000,97000,340000] [--repeat R] [--doubtful [SETS]]

Two faces (ICT, woman and man) are subdivided smoothly and reduced by edge collapse to each size, the target posed. With
`--doubtful` the pairs of sets of `tests.bench.correspondence` are aligned, each beside two faces reduced to as many
triangles. Prints the seconds by the clock and of the processor, and the stages. FOLDER, outside the repository, keeps
the surfaces.
"""

import argparse
import time
from pathlib import Path

from solver import Alignment, AlignSettings, TriangleMesh, align
from tests.bench.paper.data import read

from .correspondence.decimation import resized
from .correspondence.pairs import posed
from .correspondence.sets import SETS
from .correspondence.store import Store

FACES = ("faces_ict/ict_F_neutral.obj", "faces_ict/ict_M_neutral.obj")


def faces(triangles: tuple[int, int], store: Store) -> tuple[TriangleMesh, TriangleMesh]:
    """Return two faces of about that many triangles each, the second posed."""
    meshes = []
    for name, count in zip(FACES, triangles, strict=True):

        def make(name: str = name, count: int = count) -> dict[str, object]:
            mesh = resized(read(name), count)
            return {"vertices": mesh.vertices, "faces": mesh.faces}

        arrays = store.kept(f"resized {name} {count}", make)
        meshes.append(TriangleMesh(arrays["vertices"], arrays["faces"], name))
    return meshes[0], posed(meshes[1], 1)


def timed(source: TriangleMesh, target: TriangleMesh, settings: AlignSettings, repeat: int) -> tuple[float, Alignment]:
    """Align as often as wanted; return the least seconds of the processor and that alignment, and print all."""
    best: tuple[float, Alignment] | None = None
    for _ in range(repeat):
        clock, processor = time.perf_counter(), time.process_time()
        found = align(source, target, settings)
        clock, processor = time.perf_counter() - clock, time.process_time() - processor
        stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in found.seconds.items())
        print(f"  {clock:7.2f} s, processor {processor:7.2f} s: {stages}", flush=True)
        if best is None or processor < best[0]:
            best = processor, found
    assert best is not None
    return best


def main() -> None:
    """Print the times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--triangles", default="15000,97000,340000")
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--doubtful", nargs="?", const="teeth,hard-teeth,bodyparts")
    options = parser.parse_args()
    store = Store(options.output)
    if options.doubtful is None:
        for count in map(int, options.triangles.split(",")):
            source, target = faces((count, count), store)
            print(f"{len(source.faces)} onto {len(target.faces)} triangles")
            timed(source, target, AlignSettings(), options.repeat)
        return
    for name in options.doubtful.split(","):
        for pair in SETS[name](store, None):
            print(f"{pair.name}, {len(pair.source.faces)} onto {len(pair.target.faces)} triangles")
            seconds, found = timed(pair.source, pair.target, AlignSettings(fill_holes=pair.openings), options.repeat)
            plain = faces((len(pair.source.faces), len(pair.target.faces)), store)
            clean, _ = timed(*plain, AlignSettings(), options.repeat)
            said = ", ".join(dict.fromkeys(remark.kind for remark in found.remarks)) or "no doubt"
            print(f"  {seconds / clean:.2f} times two faces of that size; {said}", flush=True)


if __name__ == "__main__":
    main()
