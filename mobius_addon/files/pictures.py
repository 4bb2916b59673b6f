"""The pictures of an object's materials, under names that are in nobody's way where an exporter copies them."""

from __future__ import annotations

import filecmp
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import bpy

from .parts import numbered_stems

_ENDINGS = {"JPEG": ".jpg", "TARGA": ".tga", "TIFF": ".tif", "OPEN_EXR": ".exr", "BMP": ".bmp", "HDR": ".hdr"}
_TILE = "<UDIM>"


def pictures_of(obj: bpy.types.Object) -> list[bpy.types.Image]:
    """Return the pictures that the nodes of an object's materials show, each once."""
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material and slot.material.node_tree]
    return list(dict.fromkeys(_images(trees, set())))


def _images(trees: list[bpy.types.NodeTree], seen: set[bpy.types.NodeTree]) -> Iterator[bpy.types.Image]:
    for tree in trees:
        if tree in seen:
            continue
        seen.add(tree)
        for node in tree.nodes:
            image = getattr(node, "image", None)
            if isinstance(image, bpy.types.Image):
                yield image
            inner = getattr(node, "node_tree", None)
            if inner is not None:
                yield from _images([inner], seen)


def separate_pictures(obj: bpy.types.Object, folder: Path, stage: Path) -> None:
    """Have every picture of an object lie in a file whose name is free in `folder`, or there with the same content.

    Exporters copy pictures there by their names alone: two of one name would become one.

    Parameters
    ----------
    obj : bpy.types.Object
        Its materials are changed to show copies of pictures that need another name, or have no file of their own.
    folder : Path
        Where the exporter's copies will lie in the end; it need not be there.
    stage : Path
        A folder for such copies.
    """
    taken: dict[str, Path] = {}
    for number, image in enumerate(pictures_of(obj)):
        files = _files_of(image, stage / str(number))
        if not files:
            continue
        pattern = _pattern(image, files)
        for stem in numbered_stems(pattern.stem):
            names = {tile: f"{stem}{pattern.suffix}".replace(_TILE, tile) for tile in files}
            if all(_is_free(folder / names[tile], file, taken) for tile, file in files.items()):
                break
        else:
            raise AssertionError("numbers do not end")
        taken |= {names[tile].lower(): file for tile, file in files.items()}
        renamed = any(file.name != names[tile] for tile, file in files.items())
        if renamed or any(file.is_relative_to(stage) for file in files.values()):
            place = stage / f"{number} named"
            place.mkdir(parents=True)
            for tile, file in files.items():
                shutil.copyfile(file, place / names[tile])
            _show(image, place / f"{stem}{pattern.suffix}")


def _pattern(image: bpy.types.Image, files: dict[str, Path]) -> Path:
    """Return the name of a picture's file, with <UDIM> in it if it has tiles."""
    if image.source == "TILED":
        return Path(Path(image.filepath).name)
    return Path(next(iter(files.values())).name)


def _is_free(path: Path, content: Path, taken: dict[str, Path]) -> bool:
    other = taken.get(path.name.lower())
    if other is None and not (path.exists() or path.is_symlink()):
        return True
    there = [x for x in (other, path if path.exists() or path.is_symlink() else None) if x is not None]
    return all(x.is_file() and filecmp.cmp(x, content, shallow=False) for x in there)


def _files_of(image: bpy.types.Image, stage: Path) -> dict[str, Path]:
    """Return the files that hold a picture, by tile; one that is packed, or was made in Blender, is written to one."""
    named = Path(bpy.path.abspath(image.filepath, library=image.library)) if image.filepath else None
    if image.source == "TILED":
        if named is None or image.packed_file is not None:
            return {}
        tiles = [str(tile.number) for tile in image.tiles]
        files = {tile: named.with_name(named.name.replace(_TILE, tile)) for tile in tiles}
        return {tile: file for tile, file in files.items() if file.is_file()}
    if image.packed_file is None and not image.is_dirty and named is not None and named.is_file():
        return {"": named}
    ending = _ENDINGS.get(image.file_format, ".png")
    written = stage / (named.name if named is not None and named.suffix else f"{_file_name(image.name)}{ending}")
    if image.packed_file is not None and not image.is_dirty:
        stage.mkdir(parents=True)
        written.write_bytes(image.packed_file.data)
        return {"": written}
    if image.source == "GENERATED" or image.is_dirty:
        stage.mkdir(parents=True)
        copied = image.copy()
        copied.save(filepath=str(written))
        bpy.data.images.remove(copied)
        return {"": written} if written.is_file() else {}
    return {}


def _file_name(name: str) -> str:
    stem = bpy.path.clean_name(name)
    for ending in (*_ENDINGS.values(), ".png", ".jpeg", ".tiff"):
        stem = stem.removesuffix(ending.replace(".", "_"))
    return stem or "picture"


def _show(image: bpy.types.Image, path: Path) -> None:
    """Show a file in place of an image wherever that is used, in the same way."""
    shown: Any = bpy.data.images.load(str(path))
    if image.source in ("TILED", "SEQUENCE", "MOVIE"):
        shown.source = image.source
    shown.colorspace_settings.name = image.colorspace_settings.name
    shown.alpha_mode = image.alpha_mode
    image.user_remap(shown)


def separate_gltf_pictures(written: Path, folder: Path) -> None:
    """Rename the pictures beside a .gltf that was just written so that they are in nobody's way in `folder`."""
    document = json.loads(written.read_text(encoding="utf-8"))
    taken: dict[str, Path] = {}
    for image in document.get("images", []):
        if "uri" not in image or image["uri"].startswith("data:"):
            continue
        file = written.with_name(unquote(image["uri"]))
        name = next(
            f"{stem}{file.suffix}"
            for stem in numbered_stems(file.stem)
            if _is_free(folder / f"{stem}{file.suffix}", file, taken)
        )
        taken[name.lower()] = file
        if name != file.name:
            taken[name.lower()] = file.rename(file.with_name(name))
            image["uri"] = quote(name)
    written.write_text(json.dumps(document, indent="\t", separators=(",", ":"), ensure_ascii=False), encoding="utf-8")
