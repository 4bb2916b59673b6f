"""A running Dask cluster as an executor; `distributed` is imported here alone."""

from __future__ import annotations

import importlib
from concurrent.futures import Executor
from typing import Any

WAITING = 10
"""Seconds in which a scheduler has to answer."""


class Cluster:
    """A connection to a cluster whose workers see this folder, and that of the results, under the same paths.

    Parameters
    ----------
    address : str
        Of the scheduler, as "tcp://host:8786"; or a file that it wrote its address to.

    Raises
    ------
    ValueError
        `distributed` is not there, or nobody answers at that address.
    """

    def __init__(self, address: str) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError as error:
            raise ValueError("a Dask cluster needs the Python package 'distributed': uv run --group cluster") from error
        given = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
        try:
            self.client = distributed.Client(**given, timeout=WAITING, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise ValueError(f"no Dask scheduler answers at '{address}': {error}") from error

    def opened(self) -> Executor:
        """Return an executor of the cluster: it works on a task anew, elsewhere, whose worker was lost."""
        return self.client.get_executor(pure=False)

    def threads(self) -> int:
        """Return how many tasks the cluster works on at a time, now; at least 1."""
        return max(1, sum(self.client.nthreads().values()))

    def close(self) -> None:
        """Leave the cluster as it is."""
        self.client.close()
