"""What texels are given: values read from pictures, from corners of the source, or from vertices of the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ...surface.mesh import Booleans, Floats, Integers
from .inner_loops import inner_loops
from .layout import in_texels
from .picture import Picture, merged, with_margin

Texels = npt.NDArray[Any]
"""Texels, (n,), as `reference.TEXEL` lists them."""

Values = npt.NDArray[np.float32]

FINEST = 16
"""Texels of the source's picture that one of the target's is a mean of, at most, along either side: 8192 in 512."""


class Paint(Protocol):
    """Gives values to texels."""

    @property
    def channels(self) -> int:
        """How many numbers a texel gets."""
        ...

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write the values, (n, channels), of those of the texels that have a face of the source."""
        ...


@dataclass(frozen=True, eq=False)
class Page:
    """A picture, or one value, and where the faces of the source lie in it.

    Attributes
    ----------
    picture : Picture or None
    value : (channels,) float32
        What there is instead of a picture.
    corners : (f, 3, 2) float64
        Corners of the source's faces in texels.
    island : (f,) uint16
        Which of the picture's texels each of them may read.
    """

    picture: Picture | None
    value: Values
    corners: Floats
    island: npt.NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class FromPictures:
    """Values read from pictures, each at the faces that show it, from texels of the face's own island alone.

    Attributes
    ----------
    pages : tuple of Page
    page : (f,) int
        Which one each face of the source shows; -1: none.
    channels : int
    """

    pages: tuple[Page, ...]
    page: Integers
    channels: int

    @staticmethod
    def of(
        pictures: Sequence[Picture | Floats],
        corners: Sequence[Floats],
        page: Integers,
        island: Sequence[npt.NDArray[np.uint16]],
        channels: int,
    ) -> FromPictures:
        """Label the pictures by the islands of the faces that show them.

        Parameters
        ----------
        pictures : sequence of Picture, or of values, (channels,)
            One to each page.
        corners : sequence of (f, 3, 2) float64
            The UVs of the source's faces on each, (0, 0) to (1, 1) being the picture.
        page : (f,) int
        island : sequence of (f,) uint16
            For each page numbers from 1; those that overlap in its picture count as one there.
        channels : int
        """
        pages = []
        for number, (picture, uv, own) in enumerate(zip(pictures, corners, island, strict=True)):
            if not isinstance(picture, Picture):
                pages.append(Page(None, np.asarray(picture, np.float32), np.zeros((0, 3, 2)), own))
                continue
            height, width = picture.pixels.shape[:2]
            at = in_texels(uv, width, height)
            label, parent = np.zeros((height, width), np.uint16), np.arange(1 << 16).astype(np.uint16)
            inner_loops().islands(at, page, number, own, picture.wrap, label, parent)
            one = merged(label, parent)
            with_margin(label, picture.pixels)
            pages.append(Page(replace(picture, label=label), np.zeros(0, np.float32), at, one[own]))
        return FromPictures(tuple(pages), page, channels)

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write what the pictures show there; see `Paint`."""
        for number, page in enumerate(self.pages):
            if page.picture is None:
                out[(texels["face"] >= 0) & (self.page[texels["face"]] == number)] = page.value
            else:
                inner_loops().sample(page.picture, texels, page.corners, self.page, number, page.island, FINEST, out)


@dataclass(frozen=True, eq=False)
class FromCorners:
    """Values at the corners of the source's faces, (f, 3, channels), linear in between.

    `faces`, (f,), are those that it is about; None: all.
    """

    values: Floats
    faces: Booleans | None = None

    @property
    def channels(self) -> int:
        """How many numbers a corner has."""
        return self.values.shape[2]

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write the mean of each face's corners; see `Paint`."""
        chosen = texels["face"] >= 0
        if self.faces is not None:
            chosen &= self.faces[texels["face"]]
        rows = np.flatnonzero(chosen)
        out[rows] = at_corners(self.values, texels["face"][rows], texels["place"][rows])


@dataclass(frozen=True, eq=False)
class OnTarget:
    """Values at the corners of the target's triangles, (m, 3, channels), linear in between."""

    values: Floats

    @property
    def channels(self) -> int:
        """How many numbers a corner has."""
        return self.values.shape[2]

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write the mean of each triangle's corners; see `Paint`."""
        out[:] = at_corners(self.values, texels["triangle"], texels["corner"])


@dataclass(frozen=True, eq=False)
class Together:
    """Several paints, each for faces of its own."""

    paints: tuple[Paint, ...]

    @property
    def channels(self) -> int:
        """How many numbers each of them gives."""
        return self.paints[0].channels

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write what all of them give; see `Paint`."""
        for paint in self.paints:
            paint(texels, out)


@dataclass(frozen=True, eq=False)
class Stacked:
    """The channels of several paints, one after the other."""

    paints: tuple[Paint, ...]

    @property
    def channels(self) -> int:
        """How many numbers they give together."""
        return sum(paint.channels for paint in self.paints)

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write what each of them gives; see `Paint`."""
        first = 0
        for paint in self.paints:
            own = np.zeros((len(texels), paint.channels), np.float32)
            paint(texels, own)
            out[:, first : first + paint.channels] = own
            first += paint.channels


def at_corners(values: Floats, face: Integers, place: Values) -> Values:
    """Return values at places in triangles, (n, d), from those at their corners, (m, 3, d).

    `place`, (n, 2), are the barycentric coordinates of corners 1 and 2.
    """
    first = values[:, 0].astype(np.float32)
    one, two = (values[:, k].astype(np.float32) - first for k in (1, 2))
    return first[face] + place[:, :1] * one[face] + place[:, 1:] * two[face]
