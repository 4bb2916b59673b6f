"""Vertices that a file repeats, joined again."""

from __future__ import annotations

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import bmesh
import numpy as np

from ..mesh_data import foreach


def join_coinciding(mesh: bpy.types.Mesh) -> int:
    """Join vertices at exactly the same place and return how many disappeared.

    Files that store one normal and one UV per vertex repeat vertices along seams and sharp edges; as they stand, the
    surface would be cut open there.
    """
    places = foreach(mesh.vertices, "co", 3, np.float32)
    _, first, place_of = np.unique(places, axis=0, return_index=True, return_inverse=True)
    repeated = np.flatnonzero(first[place_of.ravel()] != np.arange(len(places)))
    if repeated.size:
        edit = bmesh.new()
        edit.from_mesh(mesh)
        edit.verts.ensure_lookup_table()
        kept = first[place_of.ravel()[repeated]]
        pairs = zip(repeated.tolist(), kept.tolist(), strict=True)
        bmesh.ops.weld_verts(edit, targetmap={edit.verts[gone]: edit.verts[stays] for gone, stays in pairs})
        edit.to_mesh(mesh)
        edit.free()
    return int(repeated.size)


def join_along_seams(mesh: bpy.types.Mesh) -> int:
    """Join coinciding vertices of a mesh with UVs; without them the file had no reason to repeat any."""
    return join_coinciding(mesh) if mesh.uv_layers else 0
