"""Work in a thread of its own, watched by the thread that wants it done: told how it goes, and ended at any moment.

The one that watches does nothing else, so that it is on time however long a step of the work takes.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Halt = npt.NDArray[np.int32]
"""One number that work looks at in every loop, in Python and in C: not 0 means come back at once."""

EVERY = 0.1
"""Seconds between two words about the progress."""

LATE = 0.1
"""Seconds that work may need beyond its deadline to end in order, before it is called off."""


class Halted(Exception):  # noqa: N818
    """The work was called off."""


def look(halt: Halt) -> None:
    """Raise Halted if the work is called off."""
    if halt[0]:
        raise Halted


def watched(
    work: Callable[[], None], halt: Halt, deadline: float | None, tell: Callable[[], bool | None] | None
) -> bool:
    """Do `work`, which is to end soon after `halt` is set and may raise `Halted` then; return whether it was cancelled.

    Parameters
    ----------
    work : callable
        Runs in another thread, unless there is nothing to watch for. What it raises is raised here.
    halt : (1,) int32
        Set `LATE` seconds after `deadline`, when `tell` returns False, and when this thread is interrupted.
    deadline : float, optional
        By time.perf_counter; work should look at it too.
    tell : callable, optional
        Called every `EVERY` seconds, in this thread.
    """
    if deadline is None and tell is None:
        work()
        return False
    done, failed, cancelled = threading.Event(), [], False

    def run() -> None:
        try:
            work()
        except Halted:
            pass
        except BaseException as error:  # raised again below
            failed.append(error)
        finally:
            done.set()

    thread = threading.Thread(target=run, name="search", daemon=True)
    last = np.inf if deadline is None else deadline + LATE
    thread.start()
    try:
        while not done.wait(max(min(EVERY, last - time.perf_counter()), 0)):
            if time.perf_counter() >= last:
                break
            if tell is not None and tell() is False:
                cancelled = True
                break
    finally:
        halt[0] = 1
        thread.join()
    if failed:
        raise failed[0]
    return cancelled
