"""Where long work is: its stages, timed and told to whoever waits, who may cancel."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


class Cancelled(Exception):  # noqa: N818  (not an error: the user's own wish)
    """The progress callback ended the work."""


@dataclass(frozen=True)
class Progress:
    """Where `align` is: the stage, the share of the work done in [0, 1], and what the search has proved."""

    stage: str
    fraction: float
    value: float | None = None
    upper_bound: float | None = None
    nodes: int | None = None


class Stages:
    """Times the stages and passes them to the progress callback.

    Attributes
    ----------
    progress : callable or None
        Called with a `Progress`; returns False to cancel.
    seconds : dict of str to float
        Wall-clock time of the stages that have ended, by their keys.
    """

    def __init__(self, progress: Callable[[Progress], bool | None] | None) -> None:
        self.progress = progress
        self.seconds: dict[str, float] = {}
        self._key, self._text, self._fraction, self._since = "", "", 0.0, 0.0

    def part(self, begin: float, end: float, key: str | None = None) -> Part:
        """Return the stages of a part of the work, between shares `begin` and `end`; their times under one `key`."""
        return Part(self, begin, end, key)

    def begin(self, key: str, text: str, fraction: float) -> None:
        """End the stage before and begin one: its key in `seconds`, its text, the share of the work before it."""
        self.end()
        self._key, self._text, self._fraction, self._since = key, text, fraction, time.perf_counter()
        self.tell(fraction)

    def tell(self, fraction: float) -> None:
        """Say what share of the work is done; raises `Cancelled`."""
        if self.progress is not None and self.progress(Progress(self._text, fraction)) is False:
            raise Cancelled

    def end(self) -> None:
        """End the present stage."""
        if self._key:
            spent = time.perf_counter() - self._since
            self.seconds[self._key] = self.seconds.get(self._key, 0.0) + spent
        self._key = ""

    def searching(self, share: float) -> Callable[[SearchProgress], bool | None] | None:
        """Return what a search that is a `share` of the work calls."""
        progress = self.progress
        if progress is None:
            return None

        def report(state: SearchProgress) -> bool | None:
            done = state.value / state.upper_bound if state.upper_bound > 0 else 1.0
            fraction = self._fraction + share * min(max(done, 0.0), 1.0)
            return progress(Progress(self._text, fraction, state.value, state.upper_bound, state.nodes))

        return report


@dataclass(frozen=True)
class Part:
    """The stages of a part of the work: their shares of it become shares of the whole."""

    stages: Stages
    first: float
    last: float
    key: str | None

    def _whole(self, fraction: float) -> float:
        return self.first + fraction * (self.last - self.first)

    def part(self, begin: float, end: float, key: str | None = None) -> Part:
        """Return the stages of a part of this part."""
        return Part(self.stages, self._whole(begin), self._whole(end), key or self.key)

    def begin(self, key: str, text: str, fraction: float) -> None:
        """Begin a stage, as `Stages.begin`, after a share of this part."""
        self.stages.begin(self.key or key, text, self._whole(fraction))

    def within(self, begin: float, end: float) -> Callable[[float], None]:
        """Return what turns shares of the present stage's work into progress; it may raise `Cancelled`."""
        return lambda share: self.stages.tell(self._whole(begin + share * (end - begin)))

    def searching(self, share: float) -> Callable[[SearchProgress], bool | None] | None:
        """Return what a search that is a `share` of this part calls."""
        return self.stages.searching(share * (self.last - self.first))


@dataclass(frozen=True)
class SearchProgress:
    """What is proved so far: no transformation exceeds `upper_bound`, and one in hand reaches `value`."""

    value: float
    upper_bound: float
    nodes: int
    seconds: float
