"""Files that cannot be read, in sentences."""

from __future__ import annotations

from pathlib import Path

from ..mesh_data import Refusal


class Unreadable(Refusal):
    """A file is missing, of an unknown kind or damaged, or does not hold the one mesh that is needed."""


def cut_short(path: Path, asked: str, needed: int, held: int) -> Unreadable:
    """Return the error of a file that holds fewer bytes than it says; `asked` tells where it says so."""
    return Unreadable(
        f"'{path}' is cut short or damaged: {asked}, which takes {needed:,} bytes, but there are {held:,}"
    )


def no_numbers(path: Path, count: int, first: str) -> Unreadable:
    """Return the error of a file with points whose coordinates are no places; `first` says where one is."""
    points = "a point" if count == 1 else f"{count:,} points"
    return Unreadable(
        f"'{path}' is damaged: the coordinates of {points} are no numbers that Blender can hold; the first is {first}"
    )
