"""A computation in a thread of its own, which sees only arrays, and what is to be said of it while it runs.

ESC is told to the thread, which hears it when the solver next says how far it is. Nobody waits for that, and nobody
takes its result.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ..solver import Progress

Report = Callable[[Progress], bool | None]
Work = Callable[[Report], Any]

SOON, EARLY = 1.0, 0.1
"""Seconds, and the share of the work, before which nobody can say how long it will take."""


@dataclass(frozen=True)
class Refused:
    """Work that came to nothing: its title, why, and the numbers of the objects that it was to write on or about."""

    title: str
    why: str
    objects: tuple[int, ...]


class Job:
    """A computation in a thread of its own.

    Parameters
    ----------
    work : callable
        Called with a progress callback; may touch arrays only, never bpy.
    title : str
        What it is, for the status bar.

    Attributes
    ----------
    waits : str or None
        What the finished result waits for before it is written.
    told : int or None
        Number of the workspace whose status bar speaks of it.
    timer : bpy.types.Timer or None
        What wakes its operator in the window.
    """

    current: ClassVar[Job | None] = None
    """The one that runs in the window."""

    refused: ClassVar[Refused | None] = None
    """The last one in the window, if it came to nothing."""

    def __init__(self, work: Work, title: str = "") -> None:
        self.title = title
        self.begun = time.monotonic()
        self.progress = Progress(n_("Starting"), 0.0)
        self.waits: str | None = None
        self.told: int | None = None
        self.timer: Any = None
        self.result: Any = None
        self.error: BaseException | None = None
        self._work = work
        self._stop = threading.Event()
        # no daemon: at exit Python waits until it has noticed that it should stop, rather than pulling the rug
        self._thread = threading.Thread(target=self._run, name="mobius")
        self._thread.start()

    def _run(self) -> None:
        try:
            self.result = self._work(self._note)
        except BaseException as error:  # handed to the main thread, which reports it
            self.error = error

    def _note(self, progress: Progress) -> bool:
        self.progress = progress
        return not self._stop.is_set()

    def cancel(self) -> None:
        """Ask the work to stop at its next progress call."""
        self._stop.set()

    @property
    def seconds_left(self) -> float | None:
        """About how many seconds are left, if all goes on as it went; None where that cannot be said yet."""
        spent, share = time.monotonic() - self.begun, self.progress.fraction
        return spent * (1 - share) / share if spent > SOON and share > EARLY else None

    @property
    def cancelled(self) -> bool:
        """Whether the work was asked to stop."""
        return self._stop.is_set()

    @property
    def done(self) -> bool:
        """Whether the thread has ended."""
        return not self._thread.is_alive()


def describe_proof(progress: Progress) -> str:
    """Return what the search has proved so far, or nothing outside the search."""
    if progress.value is None or progress.upper_bound is None:
        return ""
    gap = progress.upper_bound - progress.value
    return iface_("{:.1f} of at most {:.1f}, gap {:.1f}").format(progress.value, progress.upper_bound, gap)


def describe_left(job: Job) -> str:
    """Return how long the work will take yet, or nothing where that cannot be said."""
    left = job.seconds_left
    if left is None or job.waits:
        return ""
    if left < 60:
        return iface_("about {} s left").format(max(round(left), 1))
    return iface_("about {} min left").format(round(left / 60))
