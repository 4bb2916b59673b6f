"""What a mesh object has, and what of it another one has too: how losses are found by reading a file again."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from scipy.spatial import KDTree

from ...solver.surface.mesh import Floats
from ..attributes.access import BUILT_IN, SHARPNESS
from ..attributes.rig import armature_of
from ..mesh_data import foreach, in_world
from .pictures import pictures_of

_SAMPLES = 4000
"""Places at which two layers are compared."""

_SHARE = 0.98
"""Of these, how many have to agree: a few corners lie on seams whose other side is as near."""

_PLACE = 1e-3
"""How far from each other equal places may lie, of the diagonal: some files have six digits."""

# noun in the plural, and how far equal values may lie from each other in a file of few bits
_KINDS = {
    "vertex groups": 0.01,
    "shape keys": 2e-3,
    "UV maps": 2e-3,
    "color attributes": 0.02,
    "attributes": 1e-3,
}

_RENAMED = frozenset({"materials", "pictures", "actions", "armature modifiers"})
"""Things whose names files change: they are counted."""

_PROPERTIES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT4": ("vector", 4),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
}


@dataclass(frozen=True, eq=False)
class Layer:
    """Values at places on a mesh: `points`, (n, 3 + k), each a place in units of the diagonal and k numbers."""

    name: str
    points: Floats | None


@dataclass(frozen=True, eq=False)
class Contents:
    """What a mesh object has.

    Attributes
    ----------
    triangles : int
        Different ones that have an area.
    layers : dict of str to list of Layer
        By what they are called in the plural.
    things : dict of str to list of str
        Names of all else, by what it is called in the plural.
    flags : frozenset of str
        What a mesh has or has not.
    """

    triangles: int
    layers: dict[str, list[Layer]]
    things: dict[str, list[str]]
    flags: frozenset[str]


def contents_of(obj: bpy.types.Object) -> Contents:
    """Return what a mesh object, not in Edit Mode, has."""
    mesh, armature = obj.data, armature_of(obj)
    places = _places(obj)
    corner_vertex = foreach(mesh.loops, "vertex_index", 1, np.int32)
    polygon_size = foreach(mesh.polygons, "loop_total", 1, np.int32)
    mesh.calc_loop_triangles()
    triangles = foreach(mesh.loop_triangles, "vertices", 3, np.int32)
    solid = triangles[foreach(mesh.loop_triangles, "area", 1, np.float32) > 0]
    layers: dict[str, list[Layer]] = {kind: [] for kind in _KINDS}
    for attribute in mesh.attributes:
        kind = _kind(attribute)
        if kind is not None:
            layers[kind].append(Layer(attribute.name, _attribute(obj, attribute.name, places, corner_vertex)))
    layers["vertex groups"] = list(_groups(obj, places))
    if mesh.shape_keys is not None:
        layers["shape keys"] = list(_keys(obj, mesh.shape_keys, places))
    return Contents(
        len(np.unique(np.sort(solid, axis=1), axis=0)),
        layers,
        {
            "materials": [slot.material.name for slot in obj.material_slots if slot.material is not None],
            "pictures": [image.name for image in pictures_of(obj) if min(image.size) > 0],
            "modifiers": [modifier.name for modifier in obj.modifiers if modifier.type != "ARMATURE"],
            "armature modifiers": [modifier.name for modifier in obj.modifiers if modifier.type == "ARMATURE"],
            "bones": [bone.name for bone in armature.data.bones] if armature is not None else [],
            "constraints": [constraint.name for constraint in obj.constraints],
            "parents": [obj.parent.name] if obj.parent else [],
            "custom properties": [*_custom(obj), *_custom(mesh)],
            "drivers": [curve.data_path for owner in (obj, mesh, mesh.shape_keys) for curve in _drivers(owner)],
            "actions": [name for owner in (obj, mesh, mesh.shape_keys) for name in _actions(owner)],
        },
        frozenset(_flags(mesh, polygon_size)),
    )


def losses(before: Contents, after: Contents) -> str:
    """Return what one has and the other has not, as in "UV maps 'A', 'B'; custom normals"; '' if there is nothing."""
    lost = []
    for kind, tolerance in _KINDS.items():
        missing = _missing(before.layers[kind], after.layers[kind], tolerance)
        lost += _listed(kind, missing)
    for kind, names in before.things.items():
        missing = _missing_names(names, after.things[kind])
        if kind in _RENAMED:
            missing = missing[: max(0, len(names) - len(after.things[kind]))]
        lost += _listed(kind, missing)
    flags = before.flags - after.flags
    if "custom normals" in after.flags:
        flags -= {"flat shading"}  # which the normals show as well
    return "; ".join([*lost, *sorted(flags)])


def _listed(kind: str, names: list[str]) -> list[str]:
    if not names:
        return []
    quoted = ", ".join(f"'{name}'" for name in names[:6])
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    return [f"{kind if len(names) > 1 else _one(kind)} {quoted}{more}"]


def _one(plural: str) -> str:
    return plural[:-3] + "y" if plural.endswith("ies") else plural.removesuffix("s")


def _missing(before: list[Layer], after: list[Layer], tolerance: float) -> list[str]:
    """Return the names of layers that no layer of the other list is the same as, under this name or another."""
    left, missing = list(after), []
    for layer in sorted(before, key=lambda layer: not any(x.name == layer.name for x in after)):
        candidates = sorted(left, key=lambda other: other.name != layer.name)
        found = next((other for other in candidates if _same(layer, other, tolerance)), None)
        if found is None:
            missing.append(layer.name)
        else:
            left.remove(found)
    return [layer.name for layer in before if layer.name in missing]


def _same(layer: Layer, other: Layer, tolerance: float) -> bool:
    if layer.points is None or other.points is None:  # texts, matrices: by name
        return layer.name == other.name
    if layer.points.shape[1] != other.points.shape[1] or not len(other.points):
        return False
    scale = np.array([1 / _PLACE] * 3 + [1 / tolerance] * (layer.points.shape[1] - 3))
    step = max(1, len(layer.points) // _SAMPLES)
    wanted, there = np.nan_to_num(layer.points[::step] * scale), np.nan_to_num(other.points * scale)
    distance, _ = KDTree(there).query(wanted, distance_upper_bound=3.0)
    return bool((distance < np.inf).mean() >= _SHARE)


def _missing_names(before: list[str], after: list[str]) -> list[str]:
    """Return the names without an equal one; files have letters of their own for what they do not allow in names."""
    left = [_plain(name) for name in after]
    missing = []
    for name in before:
        if _plain(name) in left:
            left.remove(_plain(name))
        else:
            missing.append(name)
    return missing


def _plain(name: str) -> str:
    return plain_letters(re.sub(r"\.\d{3}$", "", name))


def plain_letters(name: str) -> str:
    """Return a name without the letters that some kinds of files exchange for others."""
    return re.sub(r"\W", "_", name).lower()


def _places(obj: bpy.types.Object) -> Floats:
    """Return the vertices in the world, (n, 3), from the corner of their box and in units of its diagonal."""
    world = in_world(obj)
    if not len(world):
        return world
    low = world.min(axis=0)
    return (world - low) / (np.linalg.norm(np.ptp(world, axis=0)) or 1.0)


def _kind(attribute: bpy.types.Attribute) -> str | None:
    if attribute.name in BUILT_IN or attribute.name.startswith(".") or attribute.is_internal:
        return None
    if attribute.data_type in ("FLOAT_COLOR", "BYTE_COLOR") and attribute.domain in ("POINT", "CORNER"):
        return "color attributes"
    return "UV maps" if (attribute.data_type, attribute.domain) == ("FLOAT2", "CORNER") else "attributes"


def _attribute(obj: bpy.types.Object, name: str, places: Floats, corner_vertex: np.ndarray) -> Floats | None:
    """Return the values of an attribute at each face corner, or, on edges, in the middle of each."""
    mesh = obj.data
    attribute = mesh.attributes[name]
    if attribute.data_type not in _PROPERTIES:
        return None
    prop, width = _PROPERTIES[attribute.data_type]
    kind = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(attribute.data_type, np.float32)
    values = foreach(attribute.data, prop, width, kind).astype(np.float64).reshape(-1, width)
    if attribute.domain == "EDGE":
        ends = foreach(mesh.edges, "vertices", 2, np.int32)
        return np.concatenate([places[ends].mean(axis=1), values], axis=1)
    if attribute.domain == "POINT":
        values = values[corner_vertex]
    elif attribute.domain == "FACE":
        values = np.repeat(values, foreach(mesh.polygons, "loop_total", 1, np.int32), axis=0)
    return np.concatenate([places[corner_vertex], values], axis=1)


def _groups(obj: bpy.types.Object, places: Floats) -> Iterator[Layer]:
    names = [group.name for group in obj.vertex_groups]
    if not names:
        return
    weights = np.zeros((len(places), len(names)))
    for vertex in obj.data.vertices:
        for element in vertex.groups:
            if element.group < len(names):
                weights[vertex.index, element.group] = element.weight
    for name, column in zip(names, weights.T, strict=True):
        yield Layer(name, np.concatenate([places, column[:, None]], axis=1))


def _keys(obj: bpy.types.Object, keys: bpy.types.Key, places: Floats) -> Iterator[Layer]:
    blocks = keys.key_blocks
    basis = foreach(keys.reference_key.points, "co", 3, np.float32).astype(np.float64)
    turn = np.array(obj.matrix_world)[:3, :3]
    own = foreach(obj.data.vertices, "co", 3, np.float32).astype(np.float64) @ turn.T
    size = np.linalg.norm(np.ptp(own, axis=0)) or 1.0
    for block in blocks:
        if block != keys.reference_key:
            moved = foreach(block.points, "co", 3, np.float32).astype(np.float64) - basis
            yield Layer(block.name, np.concatenate([places, moved @ turn.T / size], axis=1))


def _flags(mesh: bpy.types.Mesh, polygon_size: np.ndarray) -> Iterator[str]:
    marks: Iterable[tuple[str, Callable[[], Any]]] = (
        ("custom normals", lambda: mesh.has_custom_normals),
        ("seams", lambda: foreach(mesh.edges, "use_seam", 1, np.bool_).any()),
        ("sharp edges", lambda: foreach(mesh.edges, "use_edge_sharp", 1, np.bool_).any()),
        ("smooth shading", lambda: foreach(mesh.polygons, "use_smooth", 1, np.bool_).any()),
        ("flat shading", lambda: not foreach(mesh.polygons, "use_smooth", 1, np.bool_).all()),
        ("faces of more than three corners", lambda: (polygon_size > 3).any()),
        ("vertices and edges without faces", lambda: mesh.loops and _loose(mesh)),
        ("face sets", lambda: ".sculpt_face_set" in mesh.attributes),
        ("sculpt mask", lambda: ".sculpt_mask" in mesh.attributes),
    )
    for name, there in marks:
        if there():
            yield name
    nouns = {"crease": "creases", "bevel": "bevel weights", "freestyle": "Freestyle marks"}
    for start, noun in nouns.items():
        if any(attribute.name.startswith(start) for attribute in mesh.attributes if attribute.name in SHARPNESS):
            yield noun


def _loose(mesh: bpy.types.Mesh) -> bool:
    return len(np.unique(foreach(mesh.loops, "vertex_index", 1, np.int32))) < len(mesh.vertices)


def _custom(owner: Any) -> list[str]:
    """Return an object's or mesh's custom properties, without those that add-ons register."""
    return [key for key in owner.keys() if key not in owner.bl_rna.properties and not key.startswith("_")]  # noqa: SIM118


def _drivers(owner: Any) -> list[Any]:
    return list(owner.animation_data.drivers) if owner is not None and owner.animation_data else []


def _actions(owner: Any) -> list[str]:
    data = owner.animation_data if owner is not None else None
    return [data.action.name] if data is not None and data.action is not None else []
