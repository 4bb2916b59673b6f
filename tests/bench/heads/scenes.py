"""Heads as .blend files, as an artist has them, and what arrived in a file that came back."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .people import Head
from .targets import Target

PAINTED = 8
"""Vertex groups that are smooth over the whole head, beside those that it comes with and one for each part."""


def groups_of(head: Head) -> dict[str, np.ndarray]:
    """Weights of a head, (n,) each: its own, smooth ones around points of the skin, and one for each part."""
    found = dict(head.groups)
    skin = np.flatnonzero(head.part == 0)
    centres = head.vertices[skin[:: len(skin) // PAINTED][:PAINTED]]
    for k, centre in enumerate(centres):
        square = ((head.vertices - centre) ** 2).sum(axis=1)
        found[f"paint {k}"] = np.exp(-square / (2 * (0.15 * head.mesh.diagonal) ** 2))
    for part in range(int(head.part.max()) + 1):
        found[f"part {part}"] = (head.part == part).astype(float)
    return found


def save_source(head: Head, path: Path) -> None:
    """Write a head with its UVs, shape keys, vertex groups and a material for each part."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = bpy.data.meshes.new("Head")
    data.from_pydata(head.vertices.tolist(), [], np.split(head.corner, head.first[1:]))
    for part in range(int(head.part.max()) + 1):
        data.materials.append(bpy.data.materials.new(f"part {part}"))
    data.polygons.foreach_set("material_index", head.part_of_polygon.astype(np.int32))
    data.uv_layers.new(name="UVMap").uv.foreach_set("vector", head.uv.astype(np.float32).ravel())
    thing = bpy.data.objects.new("Head", data)
    bpy.context.scene.collection.objects.link(thing)
    for name, weights in groups_of(head).items():
        group = thing.vertex_groups.new(name=name)
        for vertex in np.flatnonzero(weights > 1e-4):
            group.add([int(vertex)], float(weights[vertex]), "REPLACE")
    thing.shape_key_add(name="Basis")
    for name, offset in head.keys.items():
        key = thing.shape_key_add(name=name)
        key.value = 0.0
        key.data.foreach_set("co", (head.vertices + offset).astype(np.float32).ravel())
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def save_target(target: Target, path: Path) -> None:
    """Write a target: positions and triangles alone."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = bpy.data.meshes.new("Target")
    data.from_pydata(target.mesh.vertices.tolist(), [], target.mesh.faces.tolist())
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Target", data))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@dataclass(frozen=True, eq=False)
class Arrived:
    """What a target has after a transfer.

    Attributes
    ----------
    groups : dict of str to (n,) float64
    keys : dict of str to (n, 3) float64
        Displacements.
    uv : (m, 3, 2) float64
        At the corners of its triangles.
    material : list of str
        The name of each triangle's material; "" where it has none.
    """

    groups: dict[str, np.ndarray]
    keys: dict[str, np.ndarray]
    uv: np.ndarray
    material: list[str]


def read_result(path: Path) -> Arrived:
    """Read what was written."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path))
    thing = bpy.data.objects["Target"]
    data, size = thing.data, len(thing.data.vertices)
    groups = {group.name: np.zeros(size) for group in thing.vertex_groups}
    names = [group.name for group in thing.vertex_groups]
    for vertex in data.vertices:
        for element in vertex.groups:
            groups[names[element.group]][vertex.index] = element.weight

    def places(items: object) -> np.ndarray:
        values = np.empty(3 * size, np.float32)
        items.foreach_get("co", values)  # type: ignore[attr-defined]
        return values.reshape(-1, 3).astype(float)

    basis = places(data.vertices)
    blocks = data.shape_keys.key_blocks[1:] if data.shape_keys else ()
    keys = {key.name: places(key.data) - basis for key in blocks}
    uv = np.zeros(2 * len(data.loops), np.float32)
    if data.uv_layers:
        data.uv_layers[0].uv.foreach_get("vector", uv)
    index = np.zeros(len(data.polygons), np.int32)
    data.polygons.foreach_get("material_index", index)
    slots = [slot.material.name if slot.material else "" for slot in thing.material_slots] or [""]
    return Arrived(groups, keys, uv.reshape(-1, 3, 2).astype(float), [slots[k] for k in index])
