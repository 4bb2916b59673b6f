"""Fingerprints of mesh objects for those who ask at every redraw: computed once per mesh and edit."""

from __future__ import annotations

import bpy

from ..solver import MeshError
from . import earlier_version, edits
from .mesh_data import is_mirrored, read_surface

# a cache, never the truth: it can be emptied at any time
_known: dict[tuple[int | bool, ...], tuple[str, str] | None] = {}
"""What a surface is told by, and was told by in version 0.1."""


def fingerprint_of(obj: bpy.types.Object) -> str | None:
    """Return the fingerprint of a mesh object's surface, None if it cannot be read now.

    What a script changed without telling Blender is not noticed.
    """
    found = _fingerprints(obj)
    return None if found is None else found[0]


def is_other(obj: bpy.types.Object, fingerprint: str) -> bool:
    """Return whether a mesh object is not the surface that a fingerprint was taken of; False if it cannot be read."""
    found = _fingerprints(obj)
    return found is not None and fingerprint not in found


def _fingerprints(obj: bpy.types.Object) -> tuple[str, str] | None:
    mesh = obj.data
    if mesh.is_editmode:
        return None
    key = mesh.session_uid, len(mesh.vertices), len(mesh.loops), len(mesh.polygons), is_mirrored(obj)
    if key not in _known:
        try:
            surface = read_surface(obj).rest
            _known[key] = surface.fingerprint, earlier_version.fingerprint(surface)
        except MeshError:
            _known[key] = None
    return _known[key]


def _forget(edited: int | None) -> None:
    for key in [key for key in _known if edited is None or key[0] == edited]:
        del _known[key]


def register() -> None:
    """Watch for edits."""
    edits.listen(_forget)


def unregister() -> None:
    """Stop watching."""
    edits.ignore(_forget)
    _known.clear()
