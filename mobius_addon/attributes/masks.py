"""Which part of an object takes part in a transfer, as weights of its vertices."""

from __future__ import annotations

import bpy
import numpy as np

from ...solver.surface.mesh import Floats, Integers
from ...solver.surface.tidy import Piece
from ..mesh_data import Refusal, foreach
from .settings import Mask
from .vertex_groups import read_weights

_NUMBERS = ("FLOAT", "INT", "INT8", "BOOLEAN")


def mask_names(obj: bpy.types.Object) -> list[str]:
    """Return the names that a mask of an object can have: its vertex groups and attributes of one number."""
    attributes = [x.name for x in obj.data.attributes if x.data_type in _NUMBERS and not x.name.startswith(".")]
    return [*(group.name for group in obj.vertex_groups), *attributes]


def mask_weights(obj: bpy.types.Object, mask: Mask) -> Floats | None:
    """Return how much each vertex takes part, (n,), from 0 to 1; None where nothing is masked.

    An attribute on faces, edges or face corners counts at a vertex by its mean around it.

    Raises
    ------
    Refusal
        There is no vertex group or attribute of that name, or it excludes every vertex.
    """
    if mask.by == "none":
        return None
    if mask.by == "selected":
        weights = foreach(obj.data.vertices, "select", 1, np.bool_).astype(np.float64)
    elif mask.name in obj.vertex_groups:
        weights = read_weights(obj, [mask.name])[:, 0].astype(np.float64)
    else:
        attribute = obj.data.attributes.get(mask.name)
        if attribute is None or attribute.data_type not in _NUMBERS:
            named = f"named '{mask.name}'" if mask.name else "without a name"
            raise Refusal(f"'{obj.name}' has no vertex group and no attribute of single numbers {named} for its mask")
        dtype = {"FLOAT": np.float32, "BOOLEAN": np.bool_}.get(attribute.data_type, np.int32)
        values = foreach(attribute.data, "value", 1, dtype).astype(np.float64)
        weights = np.clip(_at_vertices(obj.data, attribute.domain, values), 0, 1)
    if mask.invert:
        weights = 1 - weights
    if not (weights >= 0.5).any():
        raise Refusal(f"The mask of '{obj.name}' excludes every vertex: choose another one or invert it")
    return weights


def piece_of(obj: bpy.types.Object, name: str) -> Piece | None:
    """Return what an option names of an object, None for ''.

    The vertices, (n,), of a vertex group or attribute, or those selected for 'selection'; for 'seams' the edges,
    (k, 2), that are marked as such, along which it is cut open.
    """
    if not name:
        return None
    if name == "seams" and name not in mask_names(obj):
        marked = foreach(obj.data.edges, "use_seam", 1, np.bool_)
        if not marked.any():
            raise Refusal(f"'{obj.name}' has no edge marked as a seam: mark some in Edit Mode (Edge > Mark Seam)")
        return foreach(obj.data.edges, "vertices", 2, np.int32)[marked].astype(np.intp)
    mask = Mask("selected") if name == "selection" and name not in mask_names(obj) else Mask("named", name)
    weights = mask_weights(obj, mask)
    return None if weights is None else weights >= 0.5


def _at_vertices(mesh: bpy.types.Mesh, domain: str, values: Floats) -> Floats:
    """Return the mean of values around each vertex, (n,); 0 where there are none."""
    if domain == "POINT":
        return values
    vertex, element = _incidences(mesh, domain)
    count = np.bincount(vertex, minlength=len(mesh.vertices))
    return np.bincount(vertex, values[element], len(mesh.vertices)) / np.maximum(count, 1)


def _incidences(mesh: bpy.types.Mesh, domain: str) -> tuple[Integers, Integers]:
    """Return pairs of a vertex and an element of the domain that it belongs to."""
    if domain == "EDGE":
        return foreach(mesh.edges, "vertices", 2, np.int32).ravel(), np.repeat(np.arange(len(mesh.edges)), 2)
    corner_vertex = foreach(mesh.loops, "vertex_index", 1, np.int32)
    if domain == "CORNER":
        return corner_vertex, np.arange(len(corner_vertex))
    return corner_vertex, np.repeat(np.arange(len(mesh.polygons)), foreach(mesh.polygons, "loop_total", 1, np.int32))
