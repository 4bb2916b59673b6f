"""The files that a mesh file brings along beside it, and free names for them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import count
from pathlib import Path

PARTS = {".obj": (".mtl",), ".gltf": (".bin",), ".fbx": (".fbm",)}
"""Endings of what exporters put beside a file, under its name; an .fbm is a folder of pictures."""


def own_parts(path: Path) -> frozenset[Path]:
    """Return the files beside a mesh file that bear its name and that it names itself: they are replaced with it."""
    named: set[str] = set()
    try:
        if path.suffix.lower() == ".obj":
            with path.open(encoding="utf-8", errors="replace") as lines:
                named = {line.split(maxsplit=1)[1].strip() for line in lines if line.startswith("mtllib ")}
        elif path.suffix.lower() == ".gltf":
            buffers = json.loads(path.read_text(encoding="utf-8")).get("buffers", [])
            named = {buffer["uri"] for buffer in buffers if "uri" in buffer}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError):
        return frozenset()
    beside = {path.with_name(name) for name in named if name and Path(name).name == name}
    return frozenset(x for x in beside if x.stem == path.stem or x.stem.startswith(f"{path.stem}."))


def free_name(final: Path) -> str:
    """Return a name with a small ending to export a file under, so that what is put beside it is in nobody's way."""
    ending = final.suffix.lower()
    own = own_parts(final)
    for stem in numbered_stems(final.stem):
        beside = [final.with_name(stem + part) for part in PARTS.get(ending, ())]
        if all(path in own or path.is_dir() or not (path.exists() or path.is_symlink()) for path in beside):
            return stem + ending
    raise AssertionError("numbers do not end")


def numbered_stems(stem: str) -> Iterator[str]:
    """Yield a name and then numbered forms of it."""
    yield stem
    for number in count(1):
        yield f"{stem}.{number:03d}"
