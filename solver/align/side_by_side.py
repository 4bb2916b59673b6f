"""The same work on source and target, on two processors where the surfaces are large.

Most of it runs in numpy and scipy, where threads need not wait for each other. The results do not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import partial
from threading import Event

from ..stages import Cancelled
from ..surface.cholesky import one_thread
from ..surface.mesh import MeshError
from .prepared import Surface
from .settings import AlignSettings

Work = Callable[[Callable[[float], None]], object]
"""Work that tells what share of it is done, in [0, 1]; what is told may raise to end it."""

LARGE = 20_000
"""Triangles of each surface from which on threads save more than they wait for each other."""

EVERY = 0.1
"""Seconds between two words about the progress."""


def side_by_side(works: Sequence[Work], tell: Callable[[float], None], *, threads: bool) -> None:
    """Do all works, at the same time with `threads`, else one after the other.

    `tell` is called in this thread alone, with the share of all the work that is done; once it raises the works are
    ended, and waited for. What a work raises is raised here, that of an earlier one first.
    """
    count = len(works)
    if not threads:
        for k, work in enumerate(works):
            work(lambda share, k=k: tell((k + share) / count))
        return
    stop, shares = Event(), [0.0] * count

    def note(k: int, share: float) -> None:
        shares[k] = share
        if stop.is_set():
            raise Cancelled

    # BLAS is kept to one thread from here: two threads that did so by themselves would undo it for each other
    with one_thread(), ThreadPoolExecutor(count, "side by side") as pool:
        running = [pool.submit(work, partial(note, k)) for k, work in enumerate(works)]
        try:
            while wait(running, EVERY).not_done:
                tell(sum(shares) / count)
        except BaseException:
            stop.set()
            raise
    for each in running:
        each.result()


def worth_threads(settings: AlignSettings, source: Surface, target: Surface) -> bool:
    """Return whether two surfaces are to be worked on at the same time."""
    if settings.threads == 1 or source is target:
        return False
    return min(len(surface.original.faces) for surface in (source, target)) >= LARGE


def put_in_order(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let both surfaces be put in order; what is wrong with one is said when it is used."""
    if worth_threads(settings, source, target):
        side_by_side([partial(_in_order, surface) for surface in (source, target)], tell, threads=True)


def flattened(source: Surface, target: Surface, settings: AlignSettings, tell: Callable[[float], None]) -> None:
    """Let both surfaces be flattened; what is wrong with one is said when it is used."""
    if worth_threads(settings, source, target):
        side_by_side([partial(_flat, surface) for surface in (source, target)], tell, threads=True)


def _in_order(surface: Surface, _: Callable[[float], None]) -> None:
    with suppress(MeshError):
        _ = surface.cleaned


def _flat(surface: Surface, _: Callable[[float], None]) -> None:
    with suppress(MeshError):
        _ = surface.flattening
