"""Where the real shapes are, and whether they are there."""

import os
from pathlib import Path

from solver import TriangleMesh
from tests.solver.mesh_files import read_mesh

DATA = Path(os.environ.get("MOBIUS_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))


def absent(relative: str) -> str:
    """Return why an experiment on a file of the real data cannot run; empty if it can."""
    if (DATA / relative).exists():
        return ""
    return f"'{relative}' is not in the folder of real data: set MOBIUS_DATA to the folder that holds it"


def read(relative: str) -> TriangleMesh:
    """Read a mesh of the real data."""
    return read_mesh(DATA / relative)
