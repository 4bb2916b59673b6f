"""Whether a glTF file, or a .glb or .vrm, holds what its description asks for."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from .unreadable import Unreadable, cut_short, no_numbers

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENT_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_FLOAT = 5126
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
    except (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError) as error:
        raise Unreadable(f"'{path}' is damaged: its JSON does not describe a scene ({error!r})") from error


def _chunks(path: Path, content: bytes) -> tuple[bytes, memoryview | None]:
    """Return the JSON of a .glb and its own buffer."""
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
            own = memoryview(content)[place : place + size]
        place += size
    return text, own


def _follow(path: Path, description: dict[str, Any], own: memoryview | None) -> None:
    """Compare accessors with their buffer views, these with their buffers, and these with what there is."""
    buffers = description.get("buffers", [])
    held = [_buffer(path, buffer, own if number == 0 else None) for number, buffer in enumerate(buffers)]
    views = description.get("bufferViews", [])
    for view in views:
        end = view.get("byteOffset", 0) + view["byteLength"]
        # compressed ones stand for bytes that come to be when it is read
        if "extensions" not in view and end > buffers[view["buffer"]]["byteLength"]:
            raise cut_short(path, "a part of a buffer goes on", end, buffers[view["buffer"]]["byteLength"])
    accessors = description.get("accessors", [])
    counts = [0]
    for accessor in accessors:
        count = accessor["count"]
        if "bufferView" in accessor:
            view = views[accessor["bufferView"]]
            size = _COMPONENT_SIZES[accessor["componentType"]] * _COMPONENTS[accessor["type"]]
            end = accessor.get("byteOffset", 0) + view.get("byteStride", size) * (count - 1) + size
            if count < 1 or end > view["byteLength"]:
                raise cut_short(path, f"it asks for {count:,} values", end, view["byteLength"])
            counts.append(count)
    # without bytes of their own are the sparse ones, changes of others, which have as many; and those that Draco packs
    if "KHR_draco_mesh_compression" not in description.get("extensionsUsed", []):
        for count in (accessor["count"] for accessor in accessors if accessor["count"] > max(counts)):
            raise Unreadable(f"'{path}' is damaged: it asks for {count:,} values and holds no bytes of them")
    for number in {
        primitive["attributes"]["POSITION"]
        for mesh in description.get("meshes", [])
        for primitive in mesh["primitives"]
        if "POSITION" in primitive["attributes"]
    }:
        _require_numbers(path, accessors[number], views, held)


def _require_numbers(path: Path, accessor: dict[str, Any], views: list[Any], held: list[memoryview | None]) -> None:
    """Raise `Unreadable` if a position is none."""
    view = views[accessor["bufferView"]] if "bufferView" in accessor else None
    if view is None or accessor["componentType"] != _FLOAT or "extensions" in view:
        return
    content = held[view["buffer"]]
    if content is not None:
        start, step = view.get("byteOffset", 0) + accessor.get("byteOffset", 0), view.get("byteStride", 12)
        places = np.ndarray((accessor["count"], 3), "<f4", content, start, (step, 4))
        if (wrong := np.flatnonzero(~np.isfinite(places).all(axis=1))).size:
            raise no_numbers(path, wrong.size, f"vertex {wrong[0]:,}")


def _buffer(path: Path, buffer: dict[str, Any], own: memoryview | None) -> memoryview | None:
    """Return what is in a buffer; `own` is what the .glb itself has for it. Of a compressed one nothing is known."""
    uri, needed = buffer.get("uri"), buffer["byteLength"]
    if "extensions" in buffer:
        return None
    asked = "it names the length of its buffer"
    if uri is None:
        held = own or memoryview(b"")
    elif uri.startswith("data:"):
        held = memoryview(base64.b64decode(uri.partition(",")[2]))
    else:
        beside = path.parent / unquote(uri)
        if not beside.is_file():
            raise Unreadable(f"'{path}' needs '{beside.name}' beside it, which is not there")
        held, asked = memoryview(beside.read_bytes()), f"it names the length of '{beside.name}'"
    if needed > len(held):
        raise cut_short(path, asked, needed, len(held))
    return held
