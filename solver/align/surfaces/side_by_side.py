"""Work that can be done at the same time, on two processors: on source and target, or on one map and another.

Most of it runs in numpy and scipy, where threads need not wait for each other. The results do not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import partial
from threading import Event
from typing import TypeVar

from ...stages import Cancelled, Part, Stages
from ...surface.cholesky import one_thread
from ...surface.mesh import MeshError
from .prepared import Surface
from .settings import AlignSettings

Result = TypeVar("Result")

Work = Callable[[Callable[[float], None]], Result]
"""Work that tells what share of it is done, in [0, 1]; what is told may raise to end it."""

AT_ONCE = 2
"""Works that are done at the same time, at most: each needs memory of its own."""

LARGE = 20_000
"""Triangles of each surface from which on threads save more than they wait for each other."""

EVERY = 0.1
"""Seconds between two words about the progress."""


def side_by_side(works: Sequence[Work[Result]], tell: Callable[[float], None], *, threads: bool = True) -> list[Result]:
    """Return what all works return, done at the same time with `threads`, else one after the other.

    `tell` is called in this thread alone, with the share of all the work that is done; once it raises the works are
    ended, and waited for. What a work raises is raised here, that of an earlier one first.
    """
    count = len(works)
    if not threads or count < 2:
        return [work(lambda share, k=k: tell((k + share) / count)) for k, work in enumerate(works)]
    stop, shares = Event(), [0.0] * count

    def note(k: int, share: float) -> None:
        shares[k] = max(share, shares[k])
        if stop.is_set():
            raise Cancelled

    # BLAS is kept to one thread from here: two threads that did so by themselves would undo it for each other
    with one_thread(), ThreadPoolExecutor(AT_ONCE, "side by side") as pool:
        running = [pool.submit(work, partial(note, k)) for k, work in enumerate(works)]
        try:
            while wait(running, EVERY).not_done:
                tell(sum(shares) / count)
        except BaseException:
            stop.set()
            for each in running:
                each.cancel()
            raise
    return [each.result() for each in running]


def stages_of(note: Callable[[float], None]) -> Part:
    """Return the stages of work that is done beside other work, told as shares of it alone."""
    return Stages(lambda state: note(state.fraction)).part(0.0, 1.0)


def worth_threads(settings: AlignSettings, source: Surface, target: Surface) -> bool:
    """Return whether two surfaces are to be worked on at the same time."""
    if settings.threads == 1 or source is target:
        return False
    return min(len(surface.original.faces) for surface in (source, target)) >= LARGE


def put_in_order(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let both surfaces be put in order; what is wrong with one is said when it is used."""
    if worth_threads(settings, source, target):
        side_by_side([partial(_in_order, surface) for surface in (source, target)], tell)


def flattened(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let both surfaces be flattened; what is wrong with one is said when it is used."""
    if worth_threads(settings, source, target):
        side_by_side([partial(_flat, surface) for surface in (source, target)], tell)


def told_apart(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let the parts of both meshes be told apart; what is wrong with one is said when it is used."""
    if worth_threads(settings, source, target):
        side_by_side([partial(_parts, surface) for surface in (source, target)], tell)


def measured(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let both surfaces be measured, and if that is done at the same time, their points be chosen."""
    if not worth_threads(settings, source, target):
        side_by_side([source.descriptors, target.descriptors], tell, threads=False)
        return

    def first(note: Callable[[float], None]) -> None:
        source.descriptors(lambda share: note(0.7 * share))
        source.source_points(settings.samples, lambda share: note(0.7 + 0.3 * share))

    def second(note: Callable[[float], None]) -> None:
        # in the other order: choosing points, which keeps other threads waiting, comes while the source is measured
        target.target_points(settings.targets, lambda share: note(0.3 * share))
        target.descriptors(lambda share: note(0.3 + 0.7 * share))

    side_by_side([first, second], tell)


def _in_order(surface: Surface, note: Callable[[float], None]) -> None:
    with suppress(MeshError):
        _ = surface.cleaned
    note(1.0)


def _parts(surface: Surface, note: Callable[[float], None]) -> None:
    with suppress(MeshError):
        _ = surface.parts
    note(1.0)


def _flat(surface: Surface, note: Callable[[float], None]) -> None:
    with suppress(MeshError):
        _ = surface.flattening
    note(1.0)
