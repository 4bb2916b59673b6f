"""Pictures through a transfer map that was kept: nothing is aligned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...solver import Correspondence
from ...solver.carry.textures import KeptTurns, Stacked, TransferMap, TurnedNormals, Wanted, resample
from ...solver.carry.textures.margins import Margin
from ...solver.carry.textures.picture import Pixels
from ..attributes.carrier import Carrier
from ..mesh_data import Refusal, Surface
from .images import FIRST_TILE, read_tiles, turns_beside
from .layouts import target_layout
from .made import Made, Textures
from .settings import TextureSettings
from .source import TextureReader


def read_map(path: Path) -> dict[int, Pixels]:
    """Return the tiles of a transfer map, (height, width, 4) float32, by UDIM number.

    Raises
    ------
    Refusal
        There is no such file, or it is no transfer map.
    """
    found = _read_tiles(path)
    for pixels in found.values():
        if not (np.rint(pixels[:, :, 2]) == pixels[:, :, 2]).all():
            raise Refusal(f"'{path}' is no transfer map, as --texture-map writes them")
    if not found:
        raise Refusal(f"there is no file '{path}'")
    return found


def read_turns(path: Path, tiles: Mapping[int, Pixels]) -> dict[int, Pixels]:
    """Return how normals turn, tile by tile, from the file beside a transfer map; empty if there is none.

    Raises
    ------
    Refusal
        It is that of another map.
    """
    beside = turns_beside(path)
    found = _read_tiles(beside)
    if found and {k: x.shape for k, x in found.items()} != {k: x.shape for k, x in tiles.items()}:
        raise Refusal(f"'{beside}' does not belong to '{path}': its size or its tiles are others")
    return found


def _read_tiles(path: Path) -> dict[int, Pixels]:
    """Return the tiles of a picture of four floats, by UDIM number; none if there is no file."""
    found: dict[int, Pixels] = {}
    numbered = sorted(path.parent.glob(f"{path.stem}.[0-9][0-9][0-9][0-9]{path.suffix}"))
    for file in [path] if path.is_file() else numbered:
        image: Any = bpy.data.images.load(str(file), check_existing=False)
        try:
            image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
            pixels = read_tiles(image)[FIRST_TILE]
        finally:
            bpy.data.images.remove(image)
        if pixels.dtype != np.float32 or pixels.shape[2] != 4:
            raise Refusal(f"'{file}' is no transfer map, as --texture-map writes them")
        found[FIRST_TILE if file == path else int(file.stem.rpartition(".")[2])] = pixels
    return found


def textures_by_map(
    source: bpy.types.Object,
    target: bpy.types.Object,
    surfaces: tuple[Surface, Surface],
    tiles: Mapping[int, Pixels],
    turns: Mapping[int, Pixels],
    settings: TextureSettings,
) -> Textures:
    """Return the source's pictures where a transfer map says that they are on the target.

    Raises
    ------
    Refusal
        As `read_textures`; or the source has no pictures, or the target no UV map of its own with these tiles.
    """
    nowhere = np.full(len(surfaces[1].mesh.vertices), -1)
    none = np.zeros(len(nowhere))
    unknown = Correspondence(
        nowhere, np.zeros((len(nowhere), 3)), none > 0, none, surfaces[0].mesh.faces, len(surfaces[0].mesh.vertices)
    )
    carrier = Carrier(unknown, *surfaces)
    reader = TextureReader(source, carrier)
    plans, notes = list(reader.plans()), []
    if not turns and (normal := next((x for x in plans if x.channel.identifier == "normal"), None)):
        plans.remove(normal)
        notes.append(f"{normal.channel.label} is not carried: beside the transfer map there is no '..._normals' of it")
    if not plans:
        raise Refusal(f"'{source.name}' has no textures that a transfer map carries")
    layout = target_layout(source, target, carrier, replace(settings, layout="own"))
    if missing := set(np.unique(layout.tile).tolist()) - {0} - set(tiles):
        raise Refusal(f"the transfer map has no tile {min(missing)}, where the UV map '{layout.name}' has faces")
    pages = reader.pages
    paints = {plan.channel.identifier: reader.by_page(plan.channel, plan.paint.channels, plan.space) for plan in plans}
    alpha = "alpha" in paints and "base_color" in paints
    if alpha:
        paints["base_color"] = Stacked((paints["base_color"], paints["alpha"]))
        plans = [plan for plan in plans if plan.channel.identifier != "alpha"]
    made: list[dict[int, Pixels]] = [{} for _ in plans]
    for number, pixels in tiles.items():
        size = (pixels.shape[0], pixels.shape[1])
        if "normal" in paints:
            here = paints | {"normal": TurnedNormals(paints["normal"], KeptTurns(turns[number]))}
        else:
            here = paints
        wanted = [Wanted(here[plan.channel.identifier], plan.stored) for plan in plans]
        found = resample(TransferMap(pixels, pages), size, wanted)
        margin = Margin.of(found.covered, size[0] // 256 if settings.margin < 0 else settings.margin)
        for one, picture in zip(made, found.pixels, strict=True):
            margin.fill(picture)
            one[number] = picture
    polygon = surfaces[1].corner_polygon[surfaces[1].triangle_corners[:, 0]]
    shown = np.bincount(polygon, layout.tile > 0, int(surfaces[1].corner_polygon.max()) + 1) > 0
    pictures = tuple(Made(p.channel, x, p.space, p.settings) for p, x in zip(plans, made, strict=True))
    notes = (*dict.fromkeys(reader.notes), *notes)
    return Textures(pictures, None, None, None, layout, reader.main_material(), shown, {}, alpha, notes)
