"""What was computed once, kept in a folder: found again by all that it depends on."""

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

SOLVER = Path(__file__).resolve().parents[3] / "solver"


def digest(*parts: Any) -> str:
    """Return a short text that differs where arrays, numbers or texts do."""
    total = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            total.update(f"{part.dtype}{part.shape}".encode())
            total.update(np.ascontiguousarray(part).tobytes())
        else:
            total.update(repr(part).encode())
        total.update(b"|")
    return total.hexdigest()[:16]


@cache
def code(*without: str) -> str:
    """Return the state of the solver's source, leaving out some modules, as a short text."""
    files = sorted(f for f in SOLVER.rglob("*") if f.suffix in (".py", ".c") and f.stem not in without)
    return digest(*(f.read_bytes() for f in files if "build" not in f.parts))


class Store:
    """Results in a folder, one .npz file each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def kept(self, key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return the arrays under that key, made and written if they are not there yet."""
        path = self.folder / f"{''.join(c if c.isalnum() or c in '-_' else '_' for c in key)}.npz"
        if not path.exists():
            half = path.with_suffix(".part.npz")
            np.savez_compressed(half, **make())
            half.replace(path)
        with np.load(path) as file:
            return {name: file[name] for name in file.files}
