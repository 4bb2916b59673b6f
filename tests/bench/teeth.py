"""The seed's application: teeth compared by continuous Procrustes distances, and classified by their nearest neighbour.

    uv run --group bench python -m tests.bench.teeth -o FOLDER [--jobs N]

All pairs of the teeth in the folder that MOBIUS_TEETH names, or of `teeth` in that of MOBIUS_DATA: every .obj and .ply.
A tooth's genus is what `genera.json` there says, {"NAME": "GENUS"}, or else the letters that its name begins with.
Where `landmarks.json` is there, it tells which maps are wrong, and how well three-cycles find that out.
"""

import argparse
import json
import os
import re
from collections import Counter
from pathlib import Path

import numpy as np

from solver import AlignSettings, TriangleMesh
from solver.collection import Collection, Plan, Specimen, Told, collect, processes
from solver.collection.cycles import SUSPECT
from solver.collection.engine import processors
from tests.bench.paper.data import DATA
from tests.solver.mesh_files import read_mesh

RIGHT_MARKS = 9
"""Of 18 landmarks: where fewer than half come nearest to their own, the map is wrong."""


def teeth(folder: Path) -> list[Specimen]:
    def specimen(path: Path) -> Specimen:
        def read() -> tuple[TriangleMesh, None]:
            mesh = read_mesh(path)
            return TriangleMesh(mesh.vertices, mesh.faces, path.stem), None

        return Specimen(path.stem, f"{path.stat().st_size} {path.stat().st_mtime_ns}", read)

    return [specimen(path) for path in sorted(folder.iterdir()) if path.suffix in (".obj", ".ply")]


def genera(folder: Path, names: list[str]) -> list[str]:
    path = folder / "genera.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return [known.get(name, re.match(r"[A-Za-z]*", name)[0]) for name in names]


def classified(distances: np.ndarray, kinds: list[str]) -> tuple[int, int]:
    """Return how many specimens have a nearest neighbour of their own kind, and how many could."""
    whole = np.where(np.isfinite(distances), distances, np.inf)
    np.fill_diagonal(whole, np.inf)
    nearest = whole.argmin(axis=1)
    count = Counter(kinds)
    could = [k for k in range(len(kinds)) if count[kinds[k]] > 1]
    return sum(kinds[k] == kinds[nearest[k]] for k in could), len(could)


def marks_right(found: Collection, marks: dict) -> np.ndarray:
    """Return how many landmarks of each pair come nearest to their own, (e,)."""
    atlas, right = found.atlas, []
    for a, b in found.edges:
        here, there = (np.array(marks[found.names[k]]["landmark_vertex"]) for k in (a, b))
        here, there = (chart.cleaned.vertices_for(x) for chart, x in ((atlas.chart(a), here), (atlas.chart(b), there)))
        found_map = atlas[a, b]
        places, _ = found_map.backward(found_map.target.places[there])
        apart = found_map.source.positions(places)[:, None] - found_map.source.vertices[here]
        apart = np.linalg.norm(apart, axis=2)
        right.append(int((apart.argmin(axis=1) == np.arange(len(here))).sum()))
    return np.array(right)


def draw(found: Collection, path: Path) -> None:
    """Draw the distances, most alike beside each other, with suspect pairs marked, and where each pair's map stands."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from scipy.cluster.hierarchy import average, leaves_list
    from scipy.spatial.distance import squareform

    distances = found.distances()
    whole = np.where(np.isfinite(distances), distances, np.nanmax(distances))
    order = leaves_list(average(squareform(whole, checks=False)))
    place = {number: k for k, number in enumerate(order)}
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), gridspec_kw={"width_ratios": [1, 1.1]})
    image = left.imshow(distances[np.ix_(order, order)], cmap="Blues_r")
    for edge, bad in zip(found.edges, found.suspects, strict=True):
        if bad:
            a, b = (place[k] for k in edge)
            left.plot([a, b], [b, a], "o", color="#d9604f", markersize=4)
    names = [found.names[k] for k in order]
    left.set_xticks(range(len(names)), names, rotation=90, fontsize=8)
    left.set_yticks(range(len(names)), names, fontsize=8)
    left.set_title("Continuous Procrustes distance; dots: suspect maps", fontsize=10)
    figure.colorbar(image, ax=left, shrink=0.8)
    kinds = [name.rstrip("0123456789") for name in found.names]
    same = np.array([kinds[a] == kinds[b] for a, b in found.edges])
    values = np.array([x.distance for x in found.figures])
    shown = np.minimum(100 * found.errors, 40)
    for chosen, label, color in ((same, "same genus", "#2e7d32"), (~same, "different genera", "#5b6b8c")):
        right.scatter(values[chosen], shown[chosen], s=18, color=color, label=label)
    right.axhline(100 * SUSPECT, color="#d9604f", linewidth=1)
    right.set(xlabel="distance", ylabel="off by three-cycles, % of the diagonal (40: mirrored, or more)", title="")
    right.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--picture", type=Path, help="draw distances and cycles")
    parser.add_argument("--jobs", type=int, default=processors())
    options = parser.parse_args()
    folder = Path(os.environ.get("MOBIUS_TEETH", DATA / "teeth"))
    if not folder.is_dir():
        raise SystemExit(f"no teeth: there is no folder '{folder}'; MOBIUS_TEETH or MOBIUS_DATA names one")

    def tell(told: Told) -> None:
        if told.error or told.done == told.total or (told.fresh and told.fresh % 50 == 0):
            print(
                f"{told.stage}: {told.done} of {told.total}",
                told.name if told.error else "",
                told.error or "",
                flush=True,
            )

    found = collect(
        teeth(folder), options.output, processes(options.jobs), plan=Plan("all"),
        settings=AlignSettings(refine="mobius"), at_a_time=options.jobs, tell=tell,
    )  # fmt: skip
    if options.picture:
        draw(found, options.picture)
    kinds = genera(folder, found.names)
    distances = found.distances()
    np.set_printoptions(precision=3, suppress=True, linewidth=250, threshold=2000)
    print(found.names, "continuous Procrustes distances:", distances, sep="\n")
    right, could = classified(distances, kinds)
    print(f"nearest neighbour of the same genus: {right} of {could} that have one ({len(kinds)} teeth)")
    print(f"certified: {sum(x.certified for x in found.figures)} of {len(found.figures)}")
    seconds = [x.seconds for x in found.figures]
    print(f"seconds of one processor per pair: median {np.median(seconds):.2f}, most {max(seconds):.2f}")
    print(f"preparing: median {np.median([found.folder.specimens[n]['seconds'] for n in found.names]):.2f}")
    if (folder / "landmarks.json").exists():
        marks = json.loads((folder / "landmarks.json").read_text(encoding="utf-8"))
        if set(found.names) <= marks.keys():
            wrong = marks_right(found, marks) < RIGHT_MARKS
            hit = int((wrong & found.suspects).sum())
            print(
                f"by landmarks {wrong.sum()} of {len(wrong)} maps are wrong; three-cycles suspect "
                f"{found.suspects.sum()}: precision {hit / max(found.suspects.sum(), 1):.2f}, "
                f"recall {hit / max(wrong.sum(), 1):.2f}"
            )


if __name__ == "__main__":
    main()
