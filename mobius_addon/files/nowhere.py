"""Coordinates that are no places: nan, inf, and what single precision does not hold, which Blender reads as 0."""

from __future__ import annotations

import re

import numpy as np

from ...solver.surface.mesh import Booleans

_LARGEST = float(np.finfo(np.float32).max)

_NO_NUMBER = re.compile(rb"nan|inf", re.IGNORECASE)
_LARGE = re.compile(rb"e\+?0*(?:[2-9]\d|\d{3})")
"""An exponent of 20 or more: with fewer than 20 digits before it, a smaller one does not reach 1e38."""

_DIGITS = bytes.maketrans(b"123456789", b"000000000")


def are_places(values: np.ndarray) -> Booleans:
    """Return which numbers are coordinates that Blender can keep."""
    return np.abs(values) <= _LARGEST


def may_be_nowhere(text: bytes) -> bool:
    """Return whether any number of a text may be no place: mostly none is, and that is found in no time."""
    small = text.lower()
    large = 20 * b"0" in small.translate(_DIGITS) or _LARGE.search(small) is not None
    return large or b"nan" in small or b"inf" in small


def is_nowhere(word: bytes) -> bool:
    """Return whether a word of a text is no place; what is no word for a number at all is left to the importer."""
    if _NO_NUMBER.search(word):
        return True
    try:
        return not abs(float(word)) <= _LARGEST
    except ValueError:
        return False
