"""Closed surfaces: how exact, how fast, and how the gap of the joint search falls.

Run::

    OMP_NUM_THREADS=1 MOBIUS_DATA=FOLDER uv run --no-sync python tests/bench/closed.py [--pairs cortex david brain]

cortex: left on mirrored right, truth by index. david, brain: the target is the surface bent smoothly, its vertices
thinned to 60 % and triangulated anew, turned, scaled and moved; truth by index. Errors in % of the source's diagonal:
of the best rotation and the best Möbius transformation fitted to the truth, of what the search found, and of the dense
map. Then the gap of the joint search against time.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "solver")]

from mesh_files import read_mesh  # noqa: E402

import solver  # noqa: E402
from solver.flatten.distortion import signed_volumes  # noqa: E402
from solver.flatten.locate import TriangulatedSphere  # noqa: E402
from solver.mobius import SphereMobius  # noqa: E402

DATA = Path(os.environ.get("MOBIUS_DATA", ROOT.parent / "shared" / "data"))


def cortex() -> tuple[solver.TriangleMesh, solver.TriangleMesh, np.ndarray]:
    """Left, mirrored right, and the left's vertex of each vertex of the right."""
    left = read_mesh(DATA / "closed" / "conte69_L.ply")
    return left, read_mesh(DATA / "closed" / "conte69_R_mirrored.ply"), np.arange(len(left.vertices))


def bent(name: str) -> tuple[solver.TriangleMesh, solver.TriangleMesh, np.ndarray]:
    """A surface, the same bent and meshed anew, and the vertex that each of its vertices was."""
    source = read_mesh(DATA / "closed" / f"{name}.ply")
    rng = np.random.default_rng(0)
    kept = np.sort(rng.permutation(len(source.vertices))[: int(0.6 * len(source.vertices))])
    sphere = solver.flatten_sphere(source).sphere[kept]
    faces = ConvexHull(sphere).simplices.astype(int)
    inward = signed_volumes(sphere, faces) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    x = (source.vertices[kept] - source.vertices.mean(axis=0)) / np.sqrt(source.area)
    x = x + 0.03 * np.sin(6 * x[:, [1, 2, 0]] + rng.uniform(0, 6, 3))
    turn = SphereMobius(rotation=tuple(rng.normal(size=4).tolist())).matrix
    return source, solver.TriangleMesh(7 * x @ turn.T + 3, faces, f"{name}, bent"), kept


def error(source: solver.TriangleMesh, places: np.ndarray, truth: np.ndarray) -> float:
    """Mean distance, in % of the diagonal."""
    return float(100 * np.linalg.norm(places - source.vertices[truth], axis=1).mean() / source.diagonal)


def through(found: solver.Alignment, mobius: SphereMobius) -> np.ndarray:
    """Where a transformation carries the target's vertices on the source."""
    flat = found.source
    face, barycentric = TriangulatedSphere.of(flat.places, flat.mesh.faces).locate(
        mobius.inverse()(found.target.places)
    )
    return np.einsum("qk,qkd->qd", barycentric, flat.mesh.vertices[flat.mesh.faces[face]])


def fitted(found: solver.Alignment, truth: np.ndarray, rotation: bool) -> SphereMobius:
    """The transformation that brings the source's vertices nearest to the target's, by the truth, on the sphere."""
    start, x, y = found.mobius, found.source.places[truth], found.target.places

    def of(step: np.ndarray) -> SphereMobius:
        base = SphereMobius((0, 0, 0), start.rotation, start.reflected) if rotation else start
        a, b, c = (step[3:] / 2).tolist()
        u, v, w = (0.0, 0.0, 0.0) if rotation else step[:3].tolist()
        return SphereMobius((u, v, w), (1.0, a, b, c)) @ base

    return of(least_squares(lambda step: (of(step)(x) - y).ravel(), np.zeros(6), max_nfev=30).x)


def gaps(found: solver.Alignment) -> list[tuple[float, float]]:
    """Seconds and gap of the joint search, to 1 %."""
    seen: list[tuple[float, float]] = []
    problem = found.objective

    def tell(state: solver.SearchProgress) -> None:
        if state.value > 0 and (not seen or state.upper_bound / state.value - 1 < 0.93 * seen[-1][1]):
            seen.append((state.seconds, state.upper_bound / state.value - 1))

    source = problem.source * ([1, -1, 1] if found.mobius.reflected else [1, 1, 1])
    result = solver.sphere_search(
        source, problem.target, problem.radius, weights=problem.weights, gap=0.01, time_limit=30, progress=tell
    )
    return [*seen, (result.seconds, result.relative_gap)]


def drawn(curves: dict[str, list[tuple[float, float]]], path: Path) -> None:
    """Draw the gaps against time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.2), layout="constrained")
    axes = figure.subplots()
    for name, curve in curves.items():
        seconds, gap = np.array(curve).T
        axes.step(seconds, 100 * gap, where="post", label=name)
    axes.set(xscale="log", yscale="log", ylim=(1, 30), xlabel="seconds", ylabel="bound over value, % more")
    axes.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print the figures of the pairs."""
    parser = argparse.ArgumentParser(description="Closed surfaces.")
    parser.add_argument("--pairs", nargs="*", default=["cortex", "david", "brain"])
    parser.add_argument("--gaps", action="store_true", help="how the gap falls, too")
    parser.add_argument("--picture", type=Path, help="where to draw that")
    given = parser.parse_args()
    curves: dict[str, list[tuple[float, float]]] = {}
    print("pair, faces, rotation fitted, Möbius fitted, rotation proved, Möbius, dense, folds, gap, seconds (CPU)")
    for name in given.pairs:
        source, target, truth = cortex() if name == "cortex" else bent(name)
        begun, cpu = time.perf_counter(), time.process_time()
        found = solver.align(source, target, solver.AlignSettings(reflect="auto"))
        seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
        places = solver.interpolate(solver.correspond(found), source.vertices)
        search = found.search
        order = [0, 2, 1] if found.mobius.reflected else [0, 1, 2]
        folds = int((signed_volumes(found.carried, target.faces[:, order]) <= 0).sum())
        errors = [
            error(source, through(found, fitted(found, truth, rotation=True)), truth),
            error(source, through(found, fitted(found, truth, rotation=False)), truth),
            error(source, through(found, search.rotation), truth),
            error(source, through(found, found.mobius), truth),
            error(source, places, truth),
        ]
        figures = ", ".join(f"{x:.2f}" for x in errors)
        proved = f"{search.relative_gap:.1%}, {seconds:.1f} ({cpu:.1f})"
        print(f"{name}, {len(target.faces):,}, {figures}, {folds}, {proved}", flush=True)
        print(
            f"    {search.proved}; rotations proved: {search.rotations_certified}; {list(found.warnings)}", flush=True
        )
        if given.gaps or given.picture:
            curves[name] = gaps(found)
            print("    " + "  ".join(f"{s:.1f} s: {100 * g:.1f} %" for s, g in curves[name]), flush=True)
    if given.picture:
        drawn(curves, given.picture)


if __name__ == "__main__":
    main()
