"""Whether a glTF file, or a .glb or .vrm, holds what its description asks for."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from .unreadable import Unreadable, cut_short

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENT_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def check(path: Path) -> None:
    """Raise `Unreadable` if buffers are missing or shorter than what is said to be in them."""
    with path.open("rb") as file:
        content = file.read()
    text, own = _chunks(path, content) if content[:4] == b"glTF" else (content, None)
    try:
        description = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Unreadable(f"'{path}' is cut short or damaged: its JSON ends in an error ({error})") from error
    try:
        _follow(path, description, own)
    except (AttributeError, IndexError, KeyError, OverflowError, TypeError) as error:
        raise Unreadable(f"'{path}' is damaged: its JSON does not describe a scene ({error!r})") from error


def _chunks(path: Path, content: bytes) -> tuple[bytes, int | None]:
    """Return the JSON of a .glb and how many bytes its own buffer has."""
    if len(content) < 20:
        raise cut_short(path, "it ends in its header", 20, len(content))
    length = struct.unpack_from("<I", content, 8)[0]
    if length > len(content):
        raise cut_short(path, "its header names its length", length, len(content))
    text, own, place = b"", None, 12
    while place + 8 <= length:
        size, kind = struct.unpack_from("<II", content, place)
        place += 8
        if place + size > len(content):
            raise cut_short(path, "one of its two parts goes on", place + size, len(content))
        if kind == _JSON:
            text = content[place : place + size]
        elif kind == _BIN:
            own = size
        place += size
    return text, own


def _follow(path: Path, description: dict[str, Any], own: int | None) -> None:
    """Compare accessors with their buffer views, these with their buffers, and these with what there is."""
    buffers = description.get("buffers", [])
    for number, buffer in enumerate(buffers):
        if "extensions" not in buffer:
            _require_bytes(path, buffer.get("uri"), buffer["byteLength"], own if number == 0 else None)
    views = description.get("bufferViews", [])
    for view in views:
        end = view.get("byteOffset", 0) + view["byteLength"]
        # compressed ones stand for bytes that come to be when it is read
        if "extensions" not in view and end > buffers[view["buffer"]]["byteLength"]:
            raise cut_short(path, "a part of a buffer goes on", end, buffers[view["buffer"]]["byteLength"])
    counts = [0]
    for accessor in description.get("accessors", []):
        count = accessor["count"]
        if "bufferView" in accessor:
            view = views[accessor["bufferView"]]
            size = _COMPONENT_SIZES[accessor["componentType"]] * _COMPONENTS[accessor["type"]]
            end = accessor.get("byteOffset", 0) + view.get("byteStride", size) * (count - 1) + size
            if count < 1 or end > view["byteLength"]:
                raise cut_short(path, f"it asks for {count:,} values", end, view["byteLength"])
            counts.append(count)
    if "KHR_draco_mesh_compression" in description.get("extensionsUsed", []):
        return  # how many there are is in the compressed data
    # without bytes of their own are only the sparse ones: changes of others, which have as many
    for accessor in description.get("accessors", []):
        if accessor["count"] > max(counts):
            raise Unreadable(f"'{path}' is damaged: it asks for {accessor['count']:,} values and holds no bytes of them")


def _require_bytes(path: Path, uri: str | None, needed: int, own: int | None) -> None:
    """Raise `Unreadable` if a buffer is not there or too short; `own` is the size of the one in the .glb itself."""
    if uri is None:
        if needed > (own or 0):
            raise cut_short(path, "it names the length of its buffer", needed, own or 0)
    elif uri.startswith("data:"):
        held = len(uri.partition(",")[2]) * 3 // 4
        if needed > held:
            raise cut_short(path, "it names the length of its buffer", needed, held)
    else:
        beside = path.parent / unquote(uri)
        if not beside.is_file():
            raise Unreadable(f"'{path}' needs '{beside.name}' beside it, which is not there")
        if needed > beside.stat().st_size:
            raise cut_short(beside, f"'{path.name}' names its length", needed, beside.stat().st_size)
