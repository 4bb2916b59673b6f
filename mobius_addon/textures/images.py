"""Blender's pictures as arrays, tile by tile, and arrays as Blender's pictures."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...solver.carry.textures import exr_bytes, png_bytes
from ...solver.carry.textures.picture import Pixels
from ..mesh_data import Refusal

FIRST_TILE = 1001

# older Blender has no such choice
_AS_COPY: Any = {"save_copy": True} if "save_copy" in bpy.types.Image.bl_rna.functions["save"].parameters else {}


def read_tiles(image: Any) -> dict[int, Pixels]:
    """Return a picture's tiles, (height, width, channels) uint8 or float32, by UDIM number; without tiles it is 1001.

    Raises
    ------
    Refusal
        The picture's file is missing or cannot be read, or a tile is empty.
    """
    if image.source != "TILED":
        return {FIRST_TILE: _pixels(image, image)}
    found = {}
    with tempfile.TemporaryDirectory(dir=bpy.app.tempdir) as folder:
        packed = {x.tile_number: x for x in image.packed_files} if image.packed_file is not None else {}
        named = bpy.path.abspath(image.filepath, library=image.library)
        on_disk = {tile.number: Path(tile_path(named, tile.number)) for tile in image.tiles}
        held: dict[int, Path] = {}
        if image.is_dirty or not all(number in packed or path.is_file() for number, path in on_disk.items()):
            held = _held(image, Path(folder))
        for number, path in on_disk.items():
            if number in held:
                path = held[number]
            elif number in packed:
                path = Path(folder, f"packed.{number}{Path(packed[number].filepath).suffix}")
                path.write_bytes(packed[number].packed_file.data)
            elif not named:
                raise Refusal(f"The tile {number} of the picture '{image.name}' is empty: fill it or remove it")
            elif not path.is_file():
                raise Refusal(f"The tile {number} of the picture '{image.name}' is missing ('{path}'): find its file")
            with _loaded(path, image) as tile:
                found[number] = _pixels(tile, image)
    return found


def _held(image: Any, folder: Path) -> dict[int, Path]:
    """Return files in a folder, by UDIM number, with the tiles as Blender has them in memory, painted and not saved."""
    pattern = str(folder / "held.<UDIM>")
    path, dirty = image.filepath_raw, image.is_dirty
    # of several tiles Blender gives no other access to the pixels; it stops at one that is empty or gone
    with suppress(RuntimeError):
        image.save(filepath=pattern, **_AS_COPY)
    if not _AS_COPY:  # it counts as saved now, and Blender would quit without asking
        image.filepath_raw = path
        if dirty and not image.is_dirty:
            image.pixels[0] = image.pixels[0]
    files = {tile.number: Path(tile_path(pattern, tile.number)) for tile in image.tiles}
    return {number: path for number, path in files.items() if path.is_file()}


def tile_path(path: str, number: int) -> str:
    """Return the path of a tile from one with <UDIM> or <UVTILE> in it."""
    row, column = divmod(number - FIRST_TILE, 10)
    return path.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")


def turns_beside(path: Path) -> Path:
    """Return the file that a transfer map's own has beside it, with what normal maps need."""
    return path.with_name(f"{path.stem}_normals{path.suffix}")


@contextmanager
def _loaded(path: Path, like: Any) -> Iterator[Any]:
    """Lend a file as a picture with another one's color space."""
    image: Any = bpy.data.images.load(str(path), check_existing=False)
    try:
        image.colorspace_settings.name = like.colorspace_settings.name
        image.alpha_mode = like.alpha_mode
        yield image
    finally:
        bpy.data.images.remove(image)


def _pixels(image: Any, named: Any) -> Pixels:
    width, height = image.size
    if not width or not height or len(image.pixels) != width * height * image.channels:
        where = f" ('{image.filepath}')" if image.filepath else ""
        raise Refusal(
            f"The picture '{named.name}' is missing or cannot be read{where}: "
            "find it (File > External Data > Find Missing Files)"
        )
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    if not image.is_float:
        np.multiply(values, 255, out=values)
        values += 0.5
        values = values.astype(np.uint8)
    return values.reshape(height, width, image.channels)


def new_image(name: str, tiles: Mapping[int, Pixels], space: str) -> Any:
    """Return a new picture, packed: a PNG of bytes or an EXR of floats, with tiles if they are not the first alone.

    Parameters
    ----------
    name : str
    tiles : mapping of int to (height, width, channels) uint8 or float32
        1, 3 or 4 channels.
    space : str
        Its color space.
    """
    floats = next(iter(tiles.values())).dtype != np.uint8
    ending = "exr" if floats else "png"
    stem = bpy.path.clean_name(name)
    tiled = list(tiles) != [FIRST_TILE]
    with tempfile.TemporaryDirectory(dir=bpy.app.tempdir) as folder:
        for number, pixels in tiles.items():
            path = Path(folder, f"{stem}.{number}.{ending}" if tiled else f"{stem}.{ending}")
            path.write_bytes(exr_bytes(_four(pixels)) if floats else png_bytes(pixels))
        first = Path(folder, f"{stem}.{min(tiles)}.{ending}" if tiled else f"{stem}.{ending}")
        image: Any = bpy.data.images.load(str(first), check_existing=False)
        try:
            if tiled:
                image.filepath = str(Path(folder, f"{stem}.<UDIM>.{ending}"))
                image.source = "TILED"
                there = {tile.number for tile in image.tiles}
                for number in sorted(set(tiles) - there):
                    image.tiles.new(number)
                for tile in [tile for tile in image.tiles if tile.number not in tiles]:
                    image.tiles.remove(tile)
            image.name = name
            image.colorspace_settings.name = space
            if floats:
                image.alpha_mode = "CHANNEL_PACKED"
            image.pack()
        except BaseException:
            bpy.data.images.remove(image)
            raise
    return image


def _four(pixels: Pixels) -> Pixels:
    """Return pixels of floats with red, green, blue and alpha, (height, width, 4)."""
    result = np.ones((*pixels.shape[:2], 4), np.float32)
    result[:, :, : max(pixels.shape[2], 3)] = pixels  # one channel is grey
    return result
