"""What a person can choose about pictures, each with its default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SIZES = (16, 16384)
"""Sides of pictures, in texels, that can be chosen."""


@dataclass(frozen=True)
class TextureSettings:
    """Choices about pictures.

    Attributes
    ----------
    size : int
        Side of the pictures in texels; 0: so many that the target has as many as its part of the source.
    layout : str
        The target's "own" UV map, the source's "carried", its conformal "disc"; "auto": the first of these there is.
    margin : int
        Texels added around islands; -1: a 256th of the size.
    result : str
        "pictures" in a new material, or color "attributes".
    mask : bool
        A further picture of what has no certain counterpart, in white.
    """

    size: int = 0
    layout: Literal["auto", "own", "carried", "disc"] = "auto"
    margin: int = -1
    result: Literal["pictures", "attributes"] = "pictures"
    mask: bool = False

    def __post_init__(self) -> None:
        if self.size and not SIZES[0] <= self.size <= SIZES[1]:
            raise ValueError(f"the size of textures lies from {SIZES[0]} to {SIZES[1]}")
        if self.margin < -1:
            raise ValueError("the margin of textures is 0 or more")
