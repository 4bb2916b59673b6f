"""What runs a task in another process, wherever this package is there: found by this file, not by a module's name.

An executor pickles the function that it sends by its module and name; the solver's may differ between processes, as in
an installed extension or on a cluster's other machines. `Elsewhere` is pickled as "the NAME that this file defines",
by nothing but the standard library.
"""

from __future__ import annotations

import importlib
import operator
import os
import runpy
import sys
from pathlib import Path
from typing import Any

if __name__ == "<run_path>":
    # elsewhere, before numpy is there: one thread for each task, since tasks are what runs side by side
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))


class _ThisFile:
    """Pickled as what running this file gives."""

    def __reduce__(self) -> tuple[Any, ...]:
        return runpy.run_path, (str(Path(__file__).resolve()),)


class Elsewhere:
    """A function of `tasks` that another process finds by the folder of this file.

    Parameters
    ----------
    name : str
        The function's.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __call__(self, *given: Any) -> Any:
        """Call it here."""
        return _tasks(self.name)(*given)

    def __reduce__(self) -> tuple[Any, ...]:
        return operator.getitem, (_ThisFile(), self.name)


def _tasks(name: str) -> Any:
    folder = Path(__file__).resolve().parent
    root = str(folder.parents[1])
    if root not in sys.path:
        sys.path.append(root)
    return getattr(importlib.import_module(f"{folder.parent.name}.{folder.name}.tasks"), name)


def run(task: dict[str, Any]) -> dict[str, Any]:
    """Do a task; see `tasks.run`."""
    return _tasks("run")(task)


def begin() -> None:
    """Begin a process for tasks; see `tasks.begin`."""
    return _tasks("begin")()
