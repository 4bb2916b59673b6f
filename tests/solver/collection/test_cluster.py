"""Collections on a Dask cluster of this machine, and of fewer workers than it began with."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from families import grown, specimen

from solver import AlignSettings
from solver.collection import Told, collect, processes

distributed = pytest.importorskip("distributed", reason="no Dask: uv run --group cluster pytest")

ROUGH = AlignSettings(refine="mobius", samples=40, targets=200)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator:
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        local_directory=str(tmp_path / "dask"),
    ) as found:
        yield found


def test_a_cluster_finds_what_processes_find_though_a_worker_is_killed(cluster, tmp_path: Path) -> None:
    from solver.collection.cluster import Cluster

    many = [specimen(f"sheet-{k}", grown(k)) for k in range(6)]
    here = collect(many, tmp_path / "here", processes(2), settings=ROUGH, at_a_time=2)
    joined = Cluster(cluster.scheduler_address)
    assert joined.threads() == 2
    killed: list[int] = []

    def kill(told: Told) -> None:
        if told.stage == "pairs" and told.done == 4 and not killed:
            process = next(iter(joined.client.run(os.getpid).values()))
            killed.append(process)
            threading.Timer(0.05, os.kill, (process, signal.SIGKILL)).start()

    there = collect(many, tmp_path / "there", joined.opened, settings=ROUGH, at_a_time=2, tell=kill)
    assert killed
    assert not there.failures
    for one, other in zip(here.figures, there.figures, strict=True):
        assert (one.value, one.mobius) == (other.value, other.mobius)
    # each pair once
    assert (tmp_path / "there" / "pairs.jsonl").read_bytes().count(b"\n") == 15
    np.testing.assert_allclose(here.distances(), there.distances())
    # nothing is left with the scheduler
    deadline = time.time() + 10
    while cluster.scheduler.tasks and time.time() < deadline:
        time.sleep(0.1)
    assert not cluster.scheduler.tasks
    joined.close()


def test_where_nobody_answers_there_is_a_sentence() -> None:
    from solver.collection.cluster import Cluster

    with pytest.raises(ValueError, match="no Dask scheduler answers"):
        Cluster("tcp://127.0.0.1:9")
