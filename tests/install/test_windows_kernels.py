"""The kernels compiled for Windows compute, under Wine, what those of this machine do, to the last bit."""

import ctypes
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from solver.search.kernels import build_wheel, compiled
from solver.search.kernels.nodes import BOUND, HALF, WIDTH, X, Y, new_nodes
from solver.search.matching import Matching
from solver.search.matching import matching as make_matching

BUDGET, ROOM = 200, 8192
"""As in replay.c."""


@pytest.fixture(scope="module")
def wine() -> str:
    for name in ("wine64", "wine", "/usr/lib/wine/wine64"):
        if found := shutil.which(name):
            return found
    pytest.skip("no Wine (Debian: wine64)")


@pytest.fixture(scope="module")
def folder(wine: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel for Windows, unpacked, and the program that calls what is in it."""
    folder = tmp_path_factory.mktemp("windows")
    with zipfile.ZipFile(build_wheel.wheel("windows-x64", folder)) as wheel:
        wheel.extractall(folder)
    source, windows = Path(__file__).with_name("replay.c"), build_wheel.PLATFORMS["windows-x64"]
    # for the wheel's own processor, whose C library is compiled already
    options = ["-O3", "-target", windows.target, f"-mcpu={windows.processors[0]}"]
    command = [sys.executable, "-m", "ziglang", "cc", *options, source, "-o", folder / "replay.exe"]
    subprocess.run(command, check=True, timeout=500)
    return folder


def matching(shared: bool) -> Matching:
    """A problem in which every pair may match, with a raster, or one with weights."""
    rng = np.random.default_rng(7)
    source, target = (np.sqrt(rng.random(n)) * np.exp(2j * np.pi * rng.random(n)) * 0.95 for n in (40, 150))
    weights = None if shared else np.where(rng.random((40, 150)) < 0.3, rng.random((40, 150)), 0.0)
    return make_matching(source, target, 0.05, weights=weights)


def cells() -> np.ndarray:
    """Nodes over the disc, (64, 8)."""
    nodes = new_nodes(64)
    places = (np.arange(8) - 3.5) / 8
    nodes[:, X], nodes[:, Y] = (grid.ravel() for grid in np.meshgrid(places, places))
    nodes[:, HALF], nodes[:, WIDTH], nodes[:, BOUND] = 1 / 16, 1, 2.0**40
    return nodes


@pytest.mark.parametrize("shared", [True, False])
def test_windows_computes_the_same(shared: bool, wine: str, folder: Path) -> None:
    kernels = compiled.CompiledKernels(matching(shared), 0.83, 1e-6)
    problem, arrays = kernels._problem, {k: v for k, v in kernels._arrays.items() if v is not None}
    assert ("raster" in arrays) == shared
    nodes, value = cells(), 6 / (1 if shared else kernels.unit)
    call = [np.array([ctypes.sizeof(problem), nodes.nbytes, len(arrays), shared], np.int64).tobytes()]
    call += [np.float64(value).tobytes(), bytes(problem), nodes.tobytes()]
    for name, array in arrays.items():
        call += [np.array([getattr(type(problem), name).offset, array.nbytes], np.int64).tobytes(), array.tobytes()]
    (folder / "call").write_bytes(b"".join(call))

    expected = nodes.copy()
    left, counts, work = new_nodes(ROOM), np.zeros(4, np.int64), kernels._work()
    address = ctypes.addressof(problem)
    done = kernels._library.mobius_expand(
        address, expected.ctypes.data, len(expected), value, BUDGET,
        left.ctypes.data, ROOM, counts.ctypes.data, work, compiled.ARENA,
    )  # fmt: skip
    kernels._library.mobius_bounds(address, expected.ctypes.data, len(expected), shared, work, compiled.ARENA)
    assert counts[0] > 0
    assert len(np.unique(expected[:, BOUND])) > 3

    libraries = sorted((folder / build_wheel.PACKAGE).glob("*.dll"))
    assert len(libraries) == 2
    environment = os.environ | {"WINEPREFIX": str(folder / "prefix"), "WINEDEBUG": "-all"}
    for library in libraries:
        command = [wine, "replay.exe", str(library.relative_to(folder)), "call", "answer"]
        ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False, timeout=300)
        assert ran.returncode == 0, ran.stderr.decode(errors="replace")
        answer = (folder / "answer").read_bytes()
        assert np.frombuffer(answer[:32], np.int64).tolist() == [compiled.INTERFACE, done, *counts[:2]]
        assert answer[32 : 32 + nodes.nbytes] == expected.tobytes()
        assert answer[32 + nodes.nbytes :] == left[: counts[0]].tobytes()
