"""Flattening of the three scans of Choi and Lui: angle error, folds, CPU seconds; libigl's maps beside it.

    python tests/bench/flatten.py [--data DIR] [--large] [--factorisations]

--large adds the brain with every edge cut in two (0.4 million triangles), then the longest edges of that again up to a
million, then all of them (1.5 million). --factorisations compares solvers of the brain's Laplacian. libigl, pyamg,
qdldl and cholespy are optional (pip); what is absent is left out. Times are CPU seconds of one thread; "x bare" is the
time over the bare SuperLU factorisation of the same Laplacian. Angles between chords are not quite Möbius-invariant: a
second figure gives the same map with the mean of its vertices, not of its area, at the centre.
"""

import argparse
import importlib
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy reads it

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "solver")]

from mesh_files import read_mesh  # noqa: E402
from scipy.sparse import csc_array, csc_matrix, csr_matrix  # noqa: E402

from solver import (  # noqa: E402
    Mobius,
    TriangleMesh,
    flatten,
    topology,
)
from solver.flatten.barycentre import conformal_barycentre  # noqa: E402
from solver.flatten.distortion import Distortion, angle_errors, distortion  # noqa: E402
from solver.flatten.flatten import _surface  # noqa: E402
from solver.flatten.harmonic import _dirichlet_systems  # noqa: E402
from solver.surface.cholesky import nested_dissection_cholesky, superlu  # noqa: E402
from solver.surface.intrinsic_delaunay import without_chords  # noqa: E402

TARGETS = {"human_face": 1.21, "chinese_lion": 1.42, "human_brain": 1.46}


def seconds(job: Callable[[], object], rounds: int = 1) -> tuple[float, object]:
    """Return the least CPU time of some runs and the result."""
    times, result = [], None
    for _ in range(rounds):
        start = time.process_time()
        result = job()
        times.append(time.process_time() - start)
    return min(times), result


def fresh(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without anything remembered."""
    return TriangleMesh(mesh.vertices, mesh.faces, mesh.name)


def finer(mesh: TriangleMesh, faces: int) -> TriangleMesh:
    """Cut the longest edges in two, as many as it takes to about so many faces; at most all: four times as many."""
    lengths = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1)[:, 0], axis=1)
    share = np.bincount(mesh.edge_of_side)[np.argsort(-lengths)].cumsum()  # a face for each side that is cut
    cut = np.argsort(-lengths)[: np.searchsorted(share, faces - len(mesh.faces), side="right")]
    middle = np.full(len(mesh.edges), -1)
    middle[cut] = len(mesh.vertices) + np.arange(len(cut))
    vertices = np.concatenate([mesh.vertices, mesh.vertices[mesh.edges[cut]].mean(axis=1)])
    corners, middles = mesh.faces, middle[mesh.edge_of_side].reshape(-1, 3)
    cuts = (middles >= 0).sum(axis=1)
    # the odd side first: the cut one of one, the whole one of two
    first = np.argmax((middles >= 0) == (cuts == 1)[:, None], axis=1)
    turn = (first[:, None] + np.arange(3)) % 3
    (a, b, c), (x, y, z) = (np.take_along_axis(table, turn, axis=1).T for table in (corners, middles))
    across = np.linalg.norm(vertices[b] - vertices[y], axis=1) < np.linalg.norm(vertices[c] - vertices[z], axis=1)
    cases = (
        (cuts == 0, [(a, b, c)]),
        (cuts == 1, [(a, b, x), (a, x, c)]),
        ((cuts == 2) & across, [(a, z, y), (z, b, y), (b, c, y)]),
        ((cuts == 2) & ~across, [(a, z, y), (z, b, c), (z, c, y)]),
        (cuts == 3, [(a, z, y), (z, b, x), (y, x, c), (x, y, z)]),
    )
    pieces = [np.stack(piece, axis=1)[case] for case, several in cases for piece in several]
    return TriangleMesh(vertices, np.concatenate(pieces), mesh.name)


def dirichlet_matrix(mesh: TriangleMesh) -> csc_array:
    boundary = topology(mesh).boundary_loops[0]
    return _dirichlet_systems(without_chords(_surface(mesh, ()), boundary), boundary)[1]


def libigl_maps(mesh: TriangleMesh) -> dict[str, Callable[[], np.ndarray]]:
    """Return libigl's maps as jobs, complex (n,), none where it is absent."""
    try:
        igl = importlib.import_module("igl")
    except ImportError:
        return {}
    vertices, faces = mesh.vertices, mesh.faces.astype(np.int64)

    def harmonic() -> np.ndarray:
        loop = igl.boundary_loop(faces)
        return igl.harmonic(vertices, faces, loop, igl.map_vertices_to_circle(vertices, loop), 1) @ [1, 1j]

    def lscm() -> np.ndarray:
        loop = igl.boundary_loop(faces)
        ends = np.array([loop[0], loop[len(loop) // 2]])
        return igl.lscm(vertices, faces, ends, np.array([[0.0, 0.0], [1.0, 0.0]]))[0] @ [1, 1j]

    return {"libigl harmonic, arc length": harmonic, "libigl LSCM, free boundary": lscm}


def row(name: str, method: str, found: Distortion, cpu: float, bare: float) -> None:
    print(
        f"{name:13} {method:28} {found.mean_angle_error:7.3f} {found.percentile_99_angle_error:7.2f} {found.flips:6d} "
        f"{found.mean_dilatation:6.3f} {found.circularity:6.4f} {cpu:8.2f} {cpu / bare:7.2f}",
        flush=True,
    )


def compare(mesh: TriangleMesh, rounds: int) -> None:
    boundary = topology(mesh).boundary_loops[0]
    bare, _ = (
        seconds(lambda: superlu(dirichlet), rounds) if (dirichlet := dirichlet_matrix(mesh)) is not None else (0, 0)
    )
    print(f"{mesh.name}: {len(mesh.faces):,} faces, bare SuperLU factorisation {bare:.2f} s")
    for method in ("harmonic", "mid-edge"):
        cpu, result = seconds(lambda method=method: flatten(fresh(mesh), method), rounds)
        row(mesh.name, method, result.distortion, cpu, bare)
        if method == "harmonic" and mesh.name in TARGETS:
            error = result.distortion.mean_angle_error
            used = np.unique(mesh.faces)
            other = Mobius(conformal_barycentre(result.disc[used], np.ones(len(used))))(result.disc)
            even = angle_errors(mesh, other).mean()
            print(f"{'':13} target <= {TARGETS[mesh.name]}: {error:.4f}; {even:.4f} with the vertices' mean at 0")
    for method, job in libigl_maps(mesh).items():
        cpu, plane = seconds(job, rounds)
        if np.imag(np.conj(plane[boundary]) * np.roll(plane[boundary], -1)).sum() < 0:
            plane = plane.conj()
        row(mesh.name, method, distortion(mesh, plane, boundary), cpu, bare)


def compare_sizes(mesh: TriangleMesh) -> None:
    """Time and memory as triangles grow, to a million and beyond."""
    n = len(mesh.faces)
    print("\nfaces        seconds   x first   peak memory, GB   angle error   flips")
    first, fine = 0.0, finer(mesh, 4 * n)
    for faces in (n, 4 * n, 1_000_000, 16 * n):
        mesh = {n: mesh, 4 * n: fine}.get(faces) or finer(fine, faces)
        cpu, result = seconds(lambda mesh=mesh: flatten(fresh(mesh)), 2)
        first = first or cpu
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        found = result.distortion
        print(
            f"{len(mesh.faces):9,} {cpu:10.2f} {cpu / first:9.1f} {memory:17.2f} {found.mean_angle_error:13.3f} "
            f"{found.flips:7d}",
            flush=True,
        )


def compare_factorisations(mesh: TriangleMesh) -> None:
    """Factorise (or set up) and solve for two right-hand sides to a residual of 1e-10."""
    print("\nunknowns  solver                    set up   two solves   residual")
    for _ in range(2):
        matrix = dirichlet_matrix(mesh)
        right = np.random.default_rng(0).standard_normal((matrix.shape[0], 2))
        for name, make in solvers().items():
            try:
                cpu, solve = seconds(lambda make=make, matrix=matrix: make(matrix))
            except ImportError:
                continue
            again, x = seconds(lambda solve=solve, right=right: solve(right))
            residual = np.abs(matrix @ x - right).max()
            print(f"{matrix.shape[0]:8,}  {name:24} {cpu:7.2f} {again:12.3f} {residual:10.0e}", flush=True)
        mesh = finer(mesh, 4 * len(mesh.faces))


def solvers() -> dict[str, Callable[[csc_array], Callable[[np.ndarray], np.ndarray]]]:
    def qdldl(matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        solver = importlib.import_module("qdldl").Solver(csc_matrix(matrix))
        return lambda right: np.stack([solver.solve(column) for column in right.T], axis=1)

    def cholmod(matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        cholespy = importlib.import_module("cholespy")
        entries = matrix.tocoo()
        rows, columns = entries.row.astype(np.int32), entries.col.astype(np.int32)
        solver = cholespy.CholeskySolverD(matrix.shape[0], rows, columns, entries.data, cholespy.MatrixType.COO)

        def solve(right: np.ndarray) -> np.ndarray:
            x = np.zeros_like(right)
            solver.solve(np.ascontiguousarray(right), x)
            return x

        return solve

    def multigrid(matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        levels = importlib.import_module("pyamg").smoothed_aggregation_solver(csr_matrix(matrix))
        return lambda right: np.stack([levels.solve(x, tol=1e-10, accel="cg") for x in right.T], axis=1)

    return {
        "SuperLU (scipy)": superlu,
        "nested dissection (ours)": nested_dissection_cholesky,
        "CHOLMOD (cholespy)": cholmod,
        "LDL, AMD order (qdldl)": qdldl,
        "multigrid + CG (pyamg)": multigrid,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--factorisations", action="store_true")
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    meshes = {name: read_mesh(options.data / "scans" / f"{name}.obj") for name in TARGETS}
    print("mesh          method                       mean deg 99% deg  flips   dilat. circ.   seconds  x bare")
    for mesh in meshes.values():
        compare(mesh, options.rounds)
    if options.factorisations:
        compare_factorisations(meshes["human_brain"])
    if options.large:
        compare_sizes(meshes["human_brain"])


if __name__ == "__main__":
    main()
