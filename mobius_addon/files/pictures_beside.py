"""The pictures of a transfer, in a folder beside the file that shows them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...solver.carry.textures import exr_bytes
from ..mesh_data import Refusal
from ..textures.images import FIRST_TILE, tile_path, turns_beside
from ..textures.made import Textures
from ..textures.marks import PROPERTY
from .parts import numbered_stems
from .publishing import Outputs, real_place


def write_pictures(obj: bpy.types.Object, final: Path, written: Outputs) -> None:
    """Put the packed pictures that a transfer made for an object into a folder beside a .blend, and show them there.

    A picture whose name is taken there gets a number. Other formats are left alone: their exporters write pictures.
    """
    if final.suffix.lower() != ".blend":
        return
    folder = real_place(final).with_name(f"{final.stem}_textures")
    taken: set[Path] = set()
    for image in [x for x in bpy.data.images if x.get(PROPERTY) == obj.name and x.packed_file is not None]:
        contents = {x.tile_number if image.source == "TILED" else 0: x.packed_file.data for x in image.packed_files}
        name = Path(bpy.path.basename(image.filepath))
        patterns = (
            folder / f"{stem}{'.<UDIM>' if image.source == 'TILED' else ''}{name.suffix}"
            for stem in numbered_stems(name.name.split(".")[0])
        )
        pattern, files = next(
            (pattern, files)
            for pattern in patterns
            for files in [{number: Path(tile_path(str(pattern), number or FIRST_TILE)) for number in contents}]
            if all(_is_free(file, contents[number], taken) for number, file in files.items())
        )
        taken |= set(files.values())
        for number, file in files.items():
            if not file.exists():
                written.path(file).write_bytes(contents[number])
        image.unpack(method="REMOVE")
        image.filepath_raw = str(pattern)
        for tile in image.packed_files:
            raise Refusal(f"'{image.name}' could not be unpacked: {tile.filepath}")


def _is_free(path: Path, content: bytes, taken: set[Path]) -> bool:
    if path in taken:
        return False
    if path.is_symlink() or path.exists():
        return path.is_file() and path.read_bytes() == content
    return True


def write_map(found: Textures | None, final: Path, written: Outputs) -> None:
    """Write the transfer map of a transfer, one file, or one for each tile with its number in the name.

    And beside it, as `turns_beside` names it, how normals turn.
    """
    if found is None:
        return
    for path, kept in ((final, found.transfer_map), (turns_beside(final), found.turns)):
        tiles: dict[int, Any] = kept or {}
        for number, pixels in tiles.items():
            name = path if list(tiles) == [FIRST_TILE] else path.with_name(f"{path.stem}.{number}{path.suffix}")
            written.path(name).write_bytes(exr_bytes(pixels))
