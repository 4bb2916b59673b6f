"""Alignments in files that version 0.1 saved, which pointed at the source and had another fingerprint.

A pointer keeps what it points at in the file for ever. It is read once, when the file is opened, and dropped.
"""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

from ..solver import TriangleMesh
from .handlers import unwatch, watch


def fingerprint(mesh: TriangleMesh) -> str:
    """Return the hash of vertices and triangles that version 0.1 kept."""
    digest = hashlib.blake2b(digest_size=16)
    digest.update(mesh.vertices.astype(np.float32).tobytes())
    digest.update(mesh.faces.astype(np.int32).tobytes())
    return digest.hexdigest()


def drop_pointers() -> None:
    """Keep the source's name in place of the pointer in all meshes of the file that can be written."""
    for mesh in bpy.data.meshes:
        kept = mesh.mobius_alignment
        if kept.source is not None and mesh.is_editable:
            kept.source_name = kept.source.name
            if kept.source.type == "MESH":
                kept.source_size = len(kept.source.data.vertices)
            kept.property_unset("source")


def _on_file(*_: object) -> None:
    drop_pointers()


# what is appended comes without load_post, and in Blender 4.2 without a word: then it is seen to when it is saved
_HANDLERS = tuple((name, _on_file) for name in ("load_post", "save_pre", "blend_import_post"))


def register() -> None:
    """Watch for files."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Stop watching."""
    unwatch(*_HANDLERS)
