"""The Windows library under Wine: bounds and searched cells, bit for bit those of this machine's library.

Run::

    uv run --with ziglang python tests/bench/windows.py

needs `wine`; the first build takes two minutes.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).resolve().parent)]

from search import dense_instance, paper_instance  # noqa: E402

from solver.search.frontier import SMALLEST_CELL  # noqa: E402
from solver.search.kernels import CompiledKernels  # noqa: E402
from solver.search.kernels.build_wheel import wheel  # noqa: E402
from solver.search.kernels.compiled import ARENA, _Problem  # noqa: E402
from solver.search.kernels.nodes import HALF, WIDTH, X, Y, new_nodes, whole_disc  # noqa: E402
from solver.search.matching import Matching, matching  # noqa: E402


def problems() -> dict[str, Matching]:
    """Return one problem for each kind of raster."""
    source, target, weights = dense_instance(0, 100, 1000, 0.2)
    return {
        "100 x 100, all pairs": matching(*paper_instance(0, 100, 0.25, 0.01), 0.01, metric="euclidean"),
        "100 x 1000, weighted": matching(source, target, 0.05, weights=weights),
        "100 x 1000, some pairs": matching(source, target, 0.05, weights=weights > 0.5),
    }


def cells(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return nodes, (count, 8): the whole disc, then cells of every size."""
    nodes = new_nodes(count)
    nodes[:, X], nodes[:, Y] = rng.uniform(-0.6, 0.6, (2, count))
    nodes[:, HALF], nodes[:, WIDTH] = 2.0 ** -rng.integers(2, 30, count), 1
    return np.concatenate([whole_disc(1e9), nodes])


def packed(kernels: CompiledKernels, nodes: np.ndarray, value: float) -> bytes:
    """Return what windows.exe reads."""
    names = [name for name, *_ in _Problem._fields_]
    fields = bytes(kernels._problem)
    arrays = {names.index(name): x.tobytes() for name, x in kernels._arrays.items() if x is not None}
    parts = [struct.pack("<q", len(fields) // 8), fields, struct.pack("<q", len(arrays))]
    for word, data in arrays.items():
        parts += [struct.pack("<qq", word, len(data)), data]
    memory = kernels._library.mobius_work_bytes(kernels.points, ARENA)
    parts += [struct.pack("<qqdq", memory, ARENA, value, len(nodes)), nodes.tobytes()]
    return b"".join(parts)


def here(kernels: CompiledKernels, nodes: np.ndarray, value: float) -> np.ndarray:
    """Return what windows.exe writes, computed by this machine's library."""
    scale = np.array([1, 1, 1, 1, 1, 1, 1, kernels.unit])
    bounded = kernels.bounds(nodes * scale, raster=True) / scale
    left, _ = kernels.expand(nodes[:1] * scale, value * kernels.unit, 400)
    return np.concatenate([bounded, left / scale])


def main() -> None:
    """Compare, and say so."""
    wine = shutil.which("wine") or shutil.which("wine64")
    if wine is None:
        raise SystemExit("wine is not installed")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with zipfile.ZipFile(wheel("windows-x64", folder)) as archive:
            archive.extractall(folder)
        compiler = [sys.executable, "-m", "ziglang", "cc", "-O1", "-target", "x86_64-windows-gnu"]
        subprocess.run(
            [*compiler, str(Path(__file__).with_suffix(".c")), "-o", str(folder / "windows.exe")], check=True
        )
        for label, problem in problems().items():
            kernels, nodes = CompiledKernels(problem, 0.8, SMALLEST_CELL), cells(np.random.default_rng(0), 300)
            value = round(0.4 * problem.limit / problem.unit)
            (folder / "in").write_bytes(packed(kernels, nodes, value))
            expected = here(kernels, nodes, value)
            for library in sorted((folder / "mobius_kernels").glob("*.dll")):
                subprocess.run(
                    [wine, "windows.exe", str(library.relative_to(folder)), "in", "out"], cwd=folder, check=True
                )
                found = np.fromfile(folder / "out").reshape(-1, 8)
                same = found.shape == expected.shape and np.array_equal(found, expected)
                print(f"{label:24s} {library.name:30s} {len(found):5d} nodes: {'the same' if same else 'DIFFERENT'}")
                if not same:
                    raise SystemExit(1)


if __name__ == "__main__":
    main()
