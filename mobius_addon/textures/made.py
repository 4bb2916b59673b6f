"""Pictures that are to be made, and those that were."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...solver.carry.textures import Paint, encoded
from ...solver.carry.textures.picture import Pixels
from ...solver.surface.mesh import Floats
from .layouts import TargetLayout
from .nodes import Channel

DATA = "Non-Color"
"""Blender's color space of numbers that are no colors."""

LINEAR = "Linear Rec.709"
"""Blender's color space of the floats that it has read."""


@dataclass(frozen=True, eq=False)
class ChannelPlan:
    """One picture to be made.

    Attributes
    ----------
    channel : Channel
    paint : Paint
    space : str
        Its color space.
    floats : bool
        Whether it keeps floats, else bytes.
    settings : tuple of (str, float)
        Inputs of the node that will read it.
    """

    channel: Channel
    paint: Paint
    space: str
    floats: bool
    settings: tuple[tuple[str, float], ...] = ()

    @property
    def srgb(self) -> bool:
        """Whether its bytes are sRGB."""
        return self.space == "sRGB"

    def stored(self, values: Any) -> Pixels:
        """Return values as the picture keeps them."""
        return np.asarray(values, np.float32) if self.floats else encoded(values, srgb=self.srgb)


@dataclass(frozen=True, eq=False)
class Made:
    """A picture that was made: its tiles by UDIM number."""

    channel: Channel
    tiles: dict[int, Pixels]
    space: str
    settings: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Textures:
    """Pictures for a target, computed and not yet in Blender.

    Attributes
    ----------
    made : tuple of Made
    mask : dict of int to pixels, or None
        White where there is no certain counterpart.
    transfer_map : dict of int to pixels, or None
        u, v, number of the material and confidence.
    turns : dict of int to pixels, or None
        How normals turn from the source's tangent frames to the target's, for further normal maps.
    layout : TargetLayout
    material : str
        Name of the source's material that shows most of it, for what has no picture.
    polygons : (p,) bool
        The target's polygons that show the pictures.
    colors : dict of str to (c, 4) float64
        Linear colors at the target's face corners in place of pictures.
    alpha : bool
        Whether the base color says where the target is transparent.
    notes : tuple of str
    """

    made: tuple[Made, ...]
    mask: dict[int, Pixels] | None
    transfer_map: dict[int, Pixels] | None
    turns: dict[int, Pixels] | None
    layout: TargetLayout
    material: str
    polygons: Any
    colors: dict[str, Floats]
    alpha: bool
    notes: tuple[str, ...]
