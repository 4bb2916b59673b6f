"""Tasks done side by side by an executor: results one by one, whatever becomes of the processes that work on them."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from typing import TypeVar

from .tasks import Result, Task, plain
from .worker import Elsewhere

AHEAD = 3
"""Tasks under way or waiting at the executor, for each that it works on at a time: so many that none of its processes
waits, and so few that neither the executor nor the memory grows with the number of tasks."""

Open = Callable[[], Executor]
"""Begins an executor: the first one, and another where the processes of one have ended."""

Named = TypeVar("Named")


def processes(jobs: int | None = None) -> Open:
    """Return what begins processes of this machine: `jobs` of them, by default one for each processor it may use."""

    def opened() -> Executor:
        # spawned, not forked: a fork of a process with threads may never wake up
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(jobs or processors(), mp_context=context, initializer=Elsewhere("begin"))

    return opened


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def completed(tasks: Iterator[tuple[Named, Task]], opened: Open, at_a_time: int) -> Iterator[tuple[Named, Result]]:
    """Yield the results of tasks, in the order in which they are done.

    A task that fails gives a result with an "error". If a process ends in the middle, as for lack of memory, the tasks
    that were under way are done again, one at a time, so that the one that ends it is found, named and left out.

    Parameters
    ----------
    tasks : iterator of (name, Task)
        Taken as they are needed; the name comes back with the result.
    opened : callable
        Begins an executor.
    at_a_time : int
        How many tasks it works on at a time.
    """
    executor = opened()
    running: dict[Future[Result], tuple[Named, Task]] = {}
    again: deque[tuple[Named, Task]] = deque()
    more = True
    try:
        while True:
            if again and not running:
                name, task = again.popleft()
                running[_submitted(executor, task)] = name, task
                alone = True
            else:
                alone = bool(again)
                while more and not again and len(running) < AHEAD * at_a_time:
                    following = next(tasks, None)
                    if following is None:
                        more = False
                        break
                    running[_submitted(executor, following[1])] = following
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            broken = False
            for future in done:
                name, task = running.pop(future)
                error = future.exception()
                if isinstance(error, BrokenExecutor):
                    broken = True
                    if alone and len(done) == 1 and not running:
                        ended = "the process that worked on it ended: is there enough memory?"
                        yield name, {"error": ended, "again": True}
                    else:
                        again.append((name, task))
                elif error is not None:
                    yield name, {"error": f"{type(error).__name__}: {error}", "again": True}
                else:
                    yield name, future.result()
            if broken:
                again.extend(running.values())
                running.clear()
                executor.shutdown(wait=False)
                executor = opened()
    finally:
        for future in running:
            future.cancel()
        executor.shutdown(wait=False)


def _submitted(executor: Executor, task: Task) -> Future[Result]:
    return executor.submit(Elsewhere("run"), plain(task))
