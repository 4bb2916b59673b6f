"""Everything that was read, made into pictures: only arrays are touched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...solver.carry.textures import (
    FLAT,
    Carrying,
    InLayout,
    MapPaint,
    OnTarget,
    Resampled,
    Turns,
    Wanted,
    at_vertices,
    encoded,
    resample,
)
from ...solver.carry.textures.margins import Margin
from ...solver.surface.mesh import Floats, plural
from ..attributes.carrier import Carrier
from .layouts import TargetLayout
from .made import ChannelPlan, Made, Textures
from .settings import TextureSettings


@dataclass(frozen=True, eq=False)
class TextureReading:
    """Everything that carrying pictures needs, as arrays: `carry` may run in a thread of its own."""

    plans: tuple[ChannelPlan, ...]
    carrier: Carrier
    carrying: Carrying
    layout: TargetLayout
    size: int
    settings: TextureSettings
    map_paint: MapPaint
    turns: Turns | None
    certain: Floats
    material: str
    names: tuple[str, str]
    alpha: bool
    keeps_map: bool
    notes: tuple[str, ...]

    def carry(self, progress: Callable[[float], None] | None = None) -> Textures:
        """Make the pictures; `progress` is called with the share of the work done and may raise to end it."""
        if self.settings.result == "attributes":
            return self._result((), None, (None, None), self._colors(), ())
        wanted = [Wanted(plan.paint, plan.stored, self._gaps(plan)) for plan in self.plans]
        if self.settings.mask:
            bare = OnTarget(1 - self.certain[:, :, None])
            wanted.append(Wanted(bare, partial(encoded, srgb=False), bare.values))
        if self.keeps_map:
            nowhere = np.tile([0.0, 0.0, -1.0, 0.0], (len(self.certain), 3, 1))
            wanted.append(Wanted(self.map_paint, np.asarray, nowhere))
            if self.turns is not None:
                wanted.append(Wanted(self.turns, np.asarray))
        tiles = [number for number in np.unique(self.layout.tile).tolist() if number]
        margin = self.size // 256 if self.settings.margin < 0 else self.settings.margin
        found: list[Resampled] = []
        for number, tile in enumerate(tiles):
            finder = InLayout.of(self.carrying, self.layout.in_tile(tile), (self.size, self.size))

            def tell(share: float, number: int = number) -> None:
                if progress is not None:
                    progress((number + share) / len(tiles))

            found.append(resample(finder, (self.size, self.size), wanted, progress=tell))
            self._finish(found[-1], margin)
        by_tile = [dict(zip(tiles, x, strict=True)) for x in zip(*(one.pixels for one in found), strict=True)]
        made = tuple(
            Made(plan.channel, pixels, plan.space, plan.settings)
            for plan, pixels in zip(self.plans, by_tile, strict=False)
        )
        others = by_tile[len(self.plans) :]
        mask = others.pop(0) if self.settings.mask else None
        notes = []
        if overlaps := sum(one.overlaps for one in found):
            notes.append(
                f"faces of '{self.names[1]}' overlap in its UV map '{self.layout.name}', in "
                f"{plural(overlaps, 'texel')}: there one of them is shown"
            )
        return self._result(made, mask, (*others, None, None)[:2], {}, notes)

    def _result(self, made: Any, mask: Any, kept: Any, colors: Any, notes: Any) -> Textures:
        surface = self.carrier.target
        shown = self.carrying.known if self.carrier.gap == "leave" and not self._transparent else self.layout.tile > 0
        polygon = surface.corner_polygon[surface.triangle_corners[:, 0]]
        polygons = np.bincount(polygon, shown, int(surface.corner_polygon.max()) + 1) > 0
        alpha = self.alpha or self._transparent
        notes = (*self.notes, *notes)
        transfer_map, turns = kept
        return Textures(made, mask, transfer_map, turns, self.layout, self.material, polygons, colors, alpha, notes)

    @property
    def _transparent(self) -> bool:
        """Whether texels without a counterpart are to be seen through."""
        return self.carrier.gap == "leave" and not self.carrying.known.all() and self._color is not None

    @property
    def _color(self) -> int | None:
        return next((k for k, plan in enumerate(self.plans) if plan.channel.identifier == "base_color"), None)

    def _finish(self, found: Resampled, margin: int) -> None:
        """Add the margin, and make transparent what has no counterpart, if it is to be."""
        around = Margin.of(found.covered, margin)
        for pixels in found.pixels[: len(self.plans) + self.settings.mask]:
            around.fill(pixels)
        if self._transparent and self._color is not None:
            pixels = found.pixels[self._color]
            pixels[found.bare, 3] = 0

    def _gaps(self, plan: ChannelPlan) -> Floats | None:
        """Return what triangles without a counterpart get at their corners; None: nothing."""
        if self.carrier.gap == "leave" or self.carrying.known.all():
            return None
        faces = self.carrying.target.faces
        if plan.channel.identifier == "normal":
            return np.tile(np.array(FLAT), (len(faces), 3, 1))
        values = self.carrier.filled(at_vertices(self.carrying, plan.paint))[0]
        return values[faces]

    def _colors(self) -> dict[str, Floats]:
        """Return what the pictures show at the target's vertices, as colors at its face corners."""
        surface = self.carrier.target
        result = {}
        for plan in self.plans:
            if plan.channel.identifier == "normal":
                continue
            values = self.carrier.filled(at_vertices(self.carrying, plan.paint))[0]
            color = np.ones((len(values), 4))
            color[:, : max(values.shape[1], 3)] = values
            result[plan.channel.label] = color[surface.corner_vertex]
        return result
