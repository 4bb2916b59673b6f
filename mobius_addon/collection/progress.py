"""How far a collection is, on a terminal as a line that changes, elsewhere as a line per minute."""

from __future__ import annotations

import sys
import time

from ...solver.collection import Told
from ..streams import say_error

OFTEN, SELDOM = 0.2, 60.0
"""Seconds between looks on a terminal, and between lines elsewhere."""


class Progress:
    """Says how far the work is, and how long the rest of a stage will take at the pace so far."""

    def __init__(self) -> None:
        self.terminal = sys.stderr is not None and sys.stderr.isatty()
        self.stage = ""
        self.begun = self.said = time.monotonic()
        self.width = 0
        self.named: set[str] = set()

    def __call__(self, told: Told) -> None:
        """Say it, if it is time."""
        now = time.monotonic()
        if told.stage != self.stage:
            self.end()
            self.stage, self.begun = told.stage, now
            self.said = -OFTEN if self.terminal else now
        if told.error is not None:
            self.named.add(told.name)
            self._clear()
            say_error(f"mobius: {told.name}: {told.error}")
        if now - self.said < (OFTEN if self.terminal else SELDOM):
            return
        self.said = now
        line = self.line(told, now - self.begun)
        if not self.terminal:
            say_error(f"mobius: {line}")
            return
        sys.stderr.write("\r" + line.ljust(self.width))
        sys.stderr.flush()
        self.width = len(line)

    @staticmethod
    def line(told: Told, seconds: float) -> str:
        """Return how far a stage is that has taken some seconds."""
        left = ""
        if told.fresh and told.done < told.total:
            left = f", {duration(seconds / told.fresh * (told.total - told.done))} left"
        failed = f", {told.failed:,} failed" if told.failed else ""
        return f"{told.stage}: {told.done:,} of {told.total:,}{failed}{left}"

    def end(self) -> None:
        """Take the changing line away."""
        self._clear()

    def _clear(self) -> None:
        if self.terminal and self.width:
            sys.stderr.write("\r" + " " * self.width + "\r")
            sys.stderr.flush()
            self.width = 0


def duration(seconds: float) -> str:
    """Return a time in the units that matter.

    >>> duration(42), duration(150), duration(8000)
    ('42 s', '3 min', '2 h 13 min')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
