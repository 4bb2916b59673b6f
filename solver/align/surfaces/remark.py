"""What `align` says about a map beside its figures: sentences, each with its kind, by which it can be sorted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    "done",
    "no counterpart",
    "piece",
    "partial",
    "doubtful",
    "unsure",
    "orientation",
    "rival",
    "unproved",
    "reconsidered",
    "other parts",
    "landmarks",
    "coarse",
    "one way",
    "steps",
    "rough",
    "slit",
    "spike",
    "handle",
    "narrow",
    "deep",
    "cropped",
    "unlike",
    "other",
]
"""Kinds of remarks: what was done for the computation; what has no counterpart, as other parts or as a part of the
surface ("partial"), and that a piece was cut out; how far the map is to be doubted, and what else it might be; what the
search, the choice of parts and landmarks left open; then why a map may be doubtful, as `diagnosis.causes` finds it."""


@dataclass(frozen=True)
class Remark:
    """One sentence about a map.

    Attributes
    ----------
    kind : str
        One of `Kind`.
    text : str
        The sentence, by itself.
    before : str
        What leads to it where sentences stand in a row: of what it is said, or that it is a guess.
    """

    kind: Kind
    text: str
    before: str = ""

    @property
    def sentence(self) -> str:
        """The whole sentence."""
        return self.before + self.text
