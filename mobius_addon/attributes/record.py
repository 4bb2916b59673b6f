"""What earlier transfers wrote on a mesh, so that the next one can tell it from the person's own."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from hashlib import blake2b

import bpy

from .carrier import Values
from .table import ROWS

PROPERTY = "mobius_written"
"""The mesh's custom property that keeps it: saved with the mesh, copied with it, undone with it."""


@dataclass(frozen=True)
class Written:
    """A layer that a transfer wrote.

    Attributes
    ----------
    kind, name : str
        What it is and how it is called on the target.
    source_name : str
        How it was called on the source.
    fingerprint : str
        Of the values as they were then.
    """

    kind: str
    name: str
    source_name: str
    fingerprint: str


def written_on(mesh: bpy.types.Mesh) -> tuple[Written, ...]:
    """Return what the mesh says was written on it, whether it is still there or not."""
    try:
        return tuple(Written(**entry) for entry in json.loads(str(mesh.get(PROPERTY, "[]"))))
    except (ValueError, TypeError):  # somebody has typed into it
        return ()


def unedited(obj: bpy.types.Object, kinds: Iterable[str] | None = None) -> list[Written]:
    """Return what was written on an object's mesh and still is as it was written, of some kinds or of all."""
    known = [x for x in written_on(obj.data) if kinds is None or x.kind in kinds]
    now = _fingerprints(obj, {(x.kind, x.name) for x in known})
    return [x for x in known if now.get((x.kind, x.name)) == x.fingerprint]


def remember(obj: bpy.types.Object, kept: Iterable[Written], written: Iterable[tuple[str, str, str]]) -> None:
    """Keep on an object's mesh what was written: layers of before, and new ones by kind, name and source's name."""
    names = {(kind, name): source_name for kind, name, source_name in written}
    names = {(x.kind, x.name): x.source_name for x in kept} | names
    now = _fingerprints(obj, names)
    entries = [asdict(Written(*layer, names[layer], now[layer])) for layer in names if layer in now]
    obj.data[PROPERTY] = json.dumps(entries)


def forget_written(mesh: bpy.types.Mesh) -> None:
    """Take what is kept about written layers off a mesh: they count as the person's own from then on."""
    if PROPERTY in mesh:
        del mesh[PROPERTY]


def fingerprint(values: Values) -> str:
    """Return a hash of values, (n, ...)."""
    digest = blake2b(repr(values.shape).encode(), digest_size=16)
    digest.update(repr(values.tolist()).encode() if values.dtype == object else values.tobytes())
    return digest.hexdigest()


def _fingerprints(obj: bpy.types.Object, layers: Iterable[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Return the fingerprints of those layers, by kind and name, that are there."""
    wanted: dict[str, list[str]] = {}
    for kind, name in layers:
        wanted.setdefault(kind, []).append(name)
    return {
        (row.kind, name): fingerprint(values)
        for row in ROWS
        for name, values in (row.access.existing(obj, wanted[row.kind]) if row.kind in wanted else {}).items()
    }
