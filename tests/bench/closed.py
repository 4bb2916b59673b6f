"""Closed surfaces: how exact, how fast, how the proof goes, and beside what else there is.

    uv sync --group bench --group compare --group anatomy
    python tests/bench/closed.py -o FOLDER [--kinds cortex,heads,...] [--pairs K] [--peers all|rotation,pose,...]
                                 [--picture PICTURE.png]

Run from anywhere, with MOBIUS_DATA set to the folder of real data; FOLDER keeps the pairs. Every pair in one run, ours
first, then what else there is, given the true orientation, which ours finds by itself:

    rotation   the best rotation of the centred spheres by brute force over the rotation group, judged by curvature at
               all scales: the first stage of MoebiusRegistration (Baden, Crane and Kazhdan 2018), which needs C++ and
               was not run
    pose       open3d's pose (FPFH, RANSAC, closest points), then the nearest point
    meshmonk   that pose, then meshmonk
    zoomout    functional maps (pyfmaps) with ZoomOut

Errors are in % of the source's diagonal, of points spread evenly over the target's area; marks are landmark pairs that
are mutually nearest. Seconds are of the processor, all threads together: the machine may do other things as well.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "solver")]

import solver  # noqa: E402
from solver.flatten.distortion import signed_volumes  # noqa: E402
from solver.flatten.locate import TriangulatedSphere  # noqa: E402
from tests.bench.closed_pairs import KINDS, pairs_of  # noqa: E402
from tests.bench.correspondence import tools  # noqa: E402
from tests.bench.correspondence.pairs import Pair  # noqa: E402
from tests.bench.correspondence.score import Map, errors, mutually_nearest  # noqa: E402
from tests.bench.correspondence.store import Store  # noqa: E402

RIGHT = 3.0
"""Mean error in % below which a map is right."""

GRID, FINER, SEEN = 20_000, 5, 300
"""Rotations that are tried, some 9 degrees apart; rounds in which the best is sought around the best; points."""


def rotation(pair: Pair, store: Store) -> Map:
    """Return the map of the rotation after which curvature, diffused, differs least; by brute force."""
    del store
    source, target = (solver.Surface(mesh, largest_part=True) for mesh in (pair.source, pair.target))
    here, there = source.flattening.places, target.flattening.places
    mirror = np.array([1.0, -1.0 if pair.reflected else 1.0, 1.0])
    tree, worth = KDTree(here * mirror), source.descriptors()
    seen = target.target_points(SEEN)
    wanted = target.descriptors()[seen]
    rng = np.random.default_rng(0)
    tried, reach = Rotation.random(GRID, rng), 0.12
    best = tried[0]
    for _ in range(FINER):
        costs = [
            float(((worth[tree.query(turn.apply(there[seen], inverse=True))[1]] - wanted) ** 2).sum(axis=1).mean())
            for turn in tried
        ]
        best = tried[int(np.argmin(costs))]
        tried = Rotation.from_rotvec(rng.normal(scale=reach, size=(400, 3))) * best
        reach /= 2
    places = best.apply(there, inverse=True) * mirror
    face, barycentric = TriangulatedSphere.of(here, source.flattening.mesh.faces).locate(places)
    return Map(face, barycentric, None, {})


PEERS: dict[str, Callable[[Pair, Store], Map]] = {
    "rotation": rotation,
    "pose": tools.pose,
    "meshmonk": tools.meshmonk,
    "zoomout": tools.zoomout,
}


def ours(pair: Pair) -> tuple[solver.Alignment, dict[str, Map], int, float]:
    """Return what `align` finds, its maps after each stage, how many triangles are folded, and processor seconds."""
    begun = time.process_time()
    found = solver.align(pair.source, pair.target, solver.AlignSettings(reflect="auto"))
    seconds = time.process_time() - begun
    order = [0, 2, 1] if found.mobius.reflected else [0, 1, 2]
    folds = int((signed_volumes(found.carried, found.target.mesh.faces[:, order]) <= 0).sum())
    flat = replace(found, bending=None, overlap=None, counterpart=None)
    stages = {"proved rotation": replace(flat, mobius=found.search.rotation), "Möbius": flat, "dense": found}
    maps = {}
    for name, stage in stages.items():
        carried = solver.correspond(stage)
        maps[name] = Map(carried.face, carried.barycentric, carried.confidence, {})
    return found, maps, folds, seconds


def timed(peer: Callable[[Pair, Store], Map], pair: Pair) -> tuple[Map | None, float, str]:
    """Return what a peer finds, its processor seconds, and why it finds nothing."""
    with tempfile.TemporaryDirectory() as folder:
        begun = time.process_time()
        try:
            found, why = peer(pair, Store(Path(folder))), ""
        except (ImportError, RuntimeError, ValueError, MemoryError, np.linalg.LinAlgError) as error:
            found, why = None, f"{type(error).__name__}: {error}"
        return found, time.process_time() - begun, why


def described(pair: Pair, found: Map) -> tuple[float, str]:
    """Return the mean error, and it with the 95 % quantile and landmarks as a text."""
    error = errors(pair, found, pair.known)
    marks = pair.landmarks and f", {mutually_nearest(pair, found, pair.landmarks)}/{len(pair.landmarks.face)}"
    return float(error.mean()), f"{error.mean():.2f} (95 %: {np.quantile(error, 0.95):.2f}{marks or ''})"


def drawn(traces: dict[str, solver.SphereSearchResult], path: Path) -> None:
    """Draw value and bound against time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.4), layout="constrained")
    axes = figure.subplots()
    for number, (name, result) in enumerate(traces.items()):
        rows = [(x.seconds, x.value, x.upper_bound) for x in result.trace if x.value > 0]
        seconds, value, bound = np.array(rows).T
        unit = 100 / value[-1]
        axes.step(seconds, unit * value, where="post", color=f"C{number}", label=name)
        axes.step(seconds, unit * bound, where="post", color=f"C{number}", linestyle="dashed")
    axes.set(xscale="log", ylim=(80, 135), xlabel="seconds", ylabel="% of the value found")
    axes.legend(title="value, and the bound on all (dashed)", loc=(0.02, 0.63))
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print the figures of the pairs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the pairs, outside the repository")
    parser.add_argument("--kinds", default=",".join(KINDS), help="default: %(default)s")
    parser.add_argument("--pairs", type=int, help="only the first so many pairs of each kind")
    parser.add_argument("--peers", default="", help=f"of {', '.join(PEERS)}, or all; default: none")
    parser.add_argument("--picture", type=Path, help="where to draw value and bound against time, a pair of each kind")
    given = parser.parse_args()
    peers = list(PEERS) if given.peers == "all" else [name for name in given.peers.split(",") if name]
    store, traces = Store(given.output), {}
    for kind in given.kinds.split(","):
        means: dict[str, list[float]] = {}
        for pair in islice(pairs_of(kind, store), given.pairs):
            found, maps, folds, seconds = ours(pair)
            side = "" if found.mobius.reflected == pair.reflected else ", WRONG SIDE"
            print(
                f"{pair.kind}: {pair.name}, {len(pair.target.faces):,} faces: {folds} folds, {seconds:.1f} s{side}; "
                f"{found.search.proved}; confidence {found.mean_confidence:.2f}; {list(found.warnings)}"
            )
            for name, stage in maps.items():
                mean, text = described(pair, stage)
                means.setdefault(f"ours, {name}", []).append(mean)
                print(f"    ours, {name:16} {text}", flush=True)
            for name in peers:
                other, spent, why = timed(PEERS[name], pair)
                mean, text = (np.inf, why) if other is None else described(pair, other)
                means.setdefault(name, []).append(mean)
                print(f"    {name:22} {text}, {spent / seconds:.1f} times our time", flush=True)
            traces.setdefault(kind, found.search)
        for name, values in means.items():
            good = sum(value < RIGHT for value in values)
            print(
                f"{kind}, {name}: median {np.median(values):.2f}, worst {max(values):.2f}, right {good}/{len(values)}"
            )
    if given.picture:
        drawn(traces, given.picture)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # Blender's module can hang in the C library's exit handlers
