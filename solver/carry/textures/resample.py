"""Pictures for the target, band by band, so that no array but the pictures themselves has all their texels."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...surface.mesh import Booleans, Floats, Integers
from .carrying import Carrying
from .inner_loops import inner_loops
from .layout import in_texels
from .margins import Margin
from .paints import Paint, Texels, Values, at_corners
from .picture import Pixels
from .reference import TEXEL

BAND = 1 << 18
"""Texels worked on at once by a thread: 10 MB of them, and some ten calls a second."""

MOST_THREADS = 8
"""Of these each has a band in memory."""

Store = Callable[[Values], Pixels]
"""Turns values, (n, channels), into what the picture keeps."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """A picture to be made.

    Attributes
    ----------
    paint : Paint
    store : callable
        Turns values into pixels; `numpy.asarray` keeps them.
    gaps : (m, 3, channels) float64 or None
        Values at the corners of the target's triangles, for those without a counterpart; None: they stay 0.
    """

    paint: Paint
    store: Store
    gaps: Floats | None = None


@dataclass(frozen=True, eq=False)
class Resampled:
    """Pictures of one size, in one tile of the target's layout.

    Attributes
    ----------
    pixels : tuple of (height, width, channels) arrays
    known : (height, width) bool
        Texels in triangles that have a counterpart.
    covered : (height, width) bool
        Texels in triangles that have been given a value, the margin not among them.
    bare : (height, width) bool
        Texels in triangles that have no counterpart.
    overlaps : int
        Texels in which triangles of the target overlap; there the first is shown.
    """

    pixels: tuple[Pixels, ...]
    known: Booleans
    covered: Booleans
    bare: Booleans
    overlaps: int


class Finder(Protocol):
    """Finds what texels show."""

    def texels(self, first: int, rows: int) -> tuple[Texels, int]:
        """Return the texels of some rows, (rows, width) TEXEL, and in how many of them triangles overlap."""
        ...


@dataclass(frozen=True, eq=False)
class InLayout:
    """Texels of a picture for a layout of the target.

    Attributes
    ----------
    carrying : Carrying
    corners : (m, 3, 2) float64
        The target's layout in texels; nan where a triangle is in another picture.
    width : int
    """

    carrying: Carrying
    corners: Floats
    width: int

    @staticmethod
    def of(carrying: Carrying, corners: Floats, size: tuple[int, int]) -> InLayout:
        """Prepare a layout, of which (0, 0) to (1, 1) is the picture, of a height and width."""
        # what all threads share is found once, before there are any
        _ = carrying.place, carrying.normal, carrying.beyond, carrying.known
        return InLayout(carrying, in_texels(corners, size[1], size[0]), size[1])

    def texels(self, first: int, rows: int) -> tuple[Texels, int]:
        """Return some rows; see `Finder`."""
        return inner_loops().texels(self.carrying, self.corners, first, rows, self.width)


def resample(
    finder: Finder,
    size: tuple[int, int],
    wanted: Sequence[Wanted],
    *,
    margin: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
) -> Resampled:
    """Make pictures.

    Parameters
    ----------
    finder : Finder
    size : (int, int)
        Height and width.
    wanted : sequence of Wanted
    margin : int
        Width in texels of what is added around the islands.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    threads : int, optional
        By default as many as there are processors, up to `MOST_THREADS`.
    """
    height, width = size
    known, covered, bare = (np.zeros(size, bool) for _ in range(3))
    pixels = [
        np.zeros((height, width, x.paint.channels), x.store(np.zeros((1, x.paint.channels), np.float32)).dtype)
        for x in wanted
    ]
    rows = max(1, BAND // width)
    count = threads or min(os.cpu_count() or 1, MOST_THREADS)

    def band(first: int) -> int:
        some = slice(first, min(first + rows, height))
        texels, overlaps = finder.texels(first, some.stop - first)
        known[some] = texels["face"] >= 0
        covered[some] = known[some]
        bare[some] = (texels["triangle"] >= 0) & ~known[some]
        flat = texels.reshape(-1)
        own = np.flatnonzero(flat["triangle"] >= 0)
        flat = flat[own]
        if len(flat):
            for want, picture in zip(wanted, pixels, strict=True):
                target = picture[some].reshape(-1, want.paint.channels)
                _fill(want, flat, own, target, covered[some].reshape(-1))
        return overlaps

    overlaps, done = 0, 0
    firsts = range(0, height, rows)
    pool = ThreadPoolExecutor(count)
    try:
        for future in as_completed([pool.submit(band, first) for first in firsts]):
            overlaps += future.result()
            done += 1
            if progress is not None:
                progress(done / len(firsts))
    finally:
        pool.shutdown(cancel_futures=True)
    if margin:
        around = Margin.of(covered, margin)
        for picture in pixels:
            around.fill(picture)
    return Resampled(tuple(pixels), known, covered, bare, overlaps)


def _fill(want: Wanted, texels: Texels, own: Integers, target: Pixels, covered: Booleans) -> None:
    """Give texels, (k,), which are those numbered `own` of a band, their pixels."""
    values = np.zeros((len(texels), want.paint.channels), np.float32)
    want.paint(texels, values)
    bare = np.flatnonzero(texels["face"] < 0)
    if len(bare) and want.gaps is not None:
        values[bare] = at_corners(want.gaps, texels["triangle"][bare], texels["corner"][bare])
        covered[own[bare]] = True
    elif len(bare):
        kept = np.flatnonzero(texels["face"] >= 0)
        own, values = own[kept], values[kept]
    if len(own):
        target[own] = want.store(values)


def at_vertices(carrying: Carrying, paint: Paint) -> Floats:
    """Return what a paint gives the target's vertices, (n, channels), each a point; 0 where there is no counterpart."""
    texels = np.zeros(len(carrying.at), TEXEL)
    texels["face"] = carrying.at
    texels["place"] = carrying.correspondence.barycentric[:, 1:]
    values = np.zeros((len(texels), paint.channels), np.float32)
    paint(texels, values)
    return values.astype(np.float64)
