"""Pictures through a transfer map that was kept: nothing is aligned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...solver import Correspondence
from ...solver.carry.textures import TransferMap, Wanted, resample
from ...solver.carry.textures.margins import Margin
from ...solver.carry.textures.picture import Pixels
from ..attributes.carrier import Carrier
from ..mesh_data import Refusal, Surface
from .images import FIRST_TILE, read_tiles
from .layouts import target_layout
from .reading import Made, TextureReader, Textures
from .settings import TextureSettings


def read_map(path: Path) -> dict[int, Pixels]:
    """Return the tiles of a transfer map, (height, width, 4) float32, by UDIM number.

    Raises
    ------
    Refusal
        There is no such file, or it is no transfer map.
    """
    found: dict[int, Pixels] = {}
    numbered = sorted(path.parent.glob(f"{path.stem}.[0-9][0-9][0-9][0-9]{path.suffix}"))
    for file in [path] if path.is_file() else numbered:
        image: Any = bpy.data.images.load(str(file), check_existing=False)
        try:
            image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
            pixels = read_tiles(image)[FIRST_TILE]
        finally:
            bpy.data.images.remove(image)
        number = FIRST_TILE if file == path else int(file.stem.rpartition(".")[2])
        if (
            pixels.dtype != np.float32
            or pixels.shape[2] != 4
            or not (np.rint(pixels[:, :, 2]) == pixels[:, :, 2]).all()
        ):
            raise Refusal(f"'{file}' is no transfer map, as --texture-map writes them")
        found[number] = pixels
    if not found:
        raise Refusal(f"there is no file '{path}'")
    return found


def textures_by_map(
    source: bpy.types.Object,
    target: bpy.types.Object,
    surfaces: tuple[Surface, Surface],
    tiles: Mapping[int, Pixels],
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
    plans = [plan for plan in reader.plans() if plan.channel.identifier not in ("normal", "alpha")]
    if not plans:
        raise Refusal(f"'{source.name}' has no textures that a transfer map carries")
    layout = target_layout(source, target, carrier, replace(settings, layout="own"))
    if missing := set(np.unique(layout.tile).tolist()) - {0} - set(tiles):
        raise Refusal(f"the transfer map has no tile {min(missing)}, where the UV map '{layout.name}' has faces")
    pages = reader.pages
    wanted = [Wanted(reader.by_page(plan.channel, plan.paint.channels, plan.space), plan.stored) for plan in plans]
    made: list[dict[int, Pixels]] = [{} for _ in plans]
    for number, pixels in tiles.items():
        size = (pixels.shape[0], pixels.shape[1])
        found = resample(TransferMap(pixels, pages), size, wanted)
        margin = Margin.of(found.covered, size[0] // 256 if settings.margin < 0 else settings.margin)
        for one, picture in zip(made, found.pixels, strict=True):
            margin.fill(picture)
            one[number] = picture
    polygon = surfaces[1].corner_polygon[surfaces[1].triangle_corners[:, 0]]
    shown = np.bincount(polygon, layout.tile > 0, int(surfaces[1].corner_polygon.max()) + 1) > 0
    pictures = tuple(Made(p.channel, x, p.space, p.settings) for p, x in zip(plans, made, strict=True))
    left = [x.channel.label for x in reader.plans() if x.channel.identifier in ("normal", "alpha")]
    notes = [
        f"{label} is not carried by a transfer map, which knows no directions and no transparency" for label in left
    ]
    return Textures(
        pictures, None, None, layout, reader.main_material(), shown, {}, False, (*dict.fromkeys(reader.notes), *notes)
    )
