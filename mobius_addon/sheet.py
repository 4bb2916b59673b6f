"""A sheet of pictures: source and target below each other, at rest and with six expressions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from scipy.spatial.transform import Rotation

from ..solver import Correspondence
from ..solver.carry.fitted import is_reflected
from ..solver.carry.frames import nearest_orthogonal
from ..solver.carry.interpolate import places
from ..solver.surface.mesh import Floats
from ..solver.surface.superimposing import superimposing
from .attributes.expression_names import understood
from .mesh_data import Refusal, Surface, foreach, mirrored, rest_positions
from .studio.materials import CLAY, cover, fresh_tree
from .studio.scene import fit, light, put, render, studio, write

_TELLING = ("eyeBlink", "jawOpen", "mouthSmile", "mouthPucker", "mouthClose", "browInnerUp")
"""Expressions that are shown first: what goes wrong is seen in them."""

_SHOWN = 6
_WIDTH, _HEIGHT, _CAPTION = 2.1, 2.6, 0.3


def render_sheet(
    pair: tuple[bpy.types.Object, bpy.types.Object],
    surfaces: tuple[Surface, Surface],
    correspondence: Correspondence,
    keys: Sequence[tuple[str, str]],
    path: Path,
    *,
    samples: int = 16,
) -> None:
    """Render source and target with the same expressions into a PNG file, the target turned as the source is.

    Parameters
    ----------
    pair, surfaces : (source, target)
    correspondence : Correspondence
        Between them.
    keys : sequence of (str, str)
        Names of shape keys on the source and on the target.
    path : Path
    samples : int
        Rays per pixel.

    Raises
    ------
    Refusal
        No shape key is carried, or the file could not be written.
    """
    chosen = chosen_keys(pair[0], keys)
    if not chosen:
        raise Refusal(f"a sheet shows expressions, and no shape key of '{pair[0].name}' was carried")
    columns = len(chosen) + 1
    left, top = -_WIDTH * columns / 2, (_HEIGHT * len(pair) + _CAPTION) / 2
    with studio(_WIDTH * columns, 2 * top, samples) as scene:
        light(scene, energy=2.6, angle=0.5, rotation=(0.75, 0.15, 0.55))
        light(scene, energy=0.8, angle=1.0, rotation=(1.2, 0.0, -1.0))
        clay = _clay()
        turns = poses(pair[0], surfaces, correspondence)
        for row, (obj, surface, turn) in enumerate(zip(pair, surfaces, turns, strict=True)):
            rest = surface.rest.vertices
            moved = [np.sum([key_displacement(obj, x[row]) for x in together(names, keys)], axis=0) for names in chosen]
            shapes = [rest] + [rest + mirrored(obj, values) for values in moved]
            every = bpy.data.meshes.new("Studio")
            every.from_pydata(np.concatenate(shapes).tolist(), [], [])
            for column, shape in enumerate(shapes):
                corner = np.array([left + _WIDTH * column, top - _HEIGHT * (row + 1)])
                frame = np.array([corner + 0.05, corner + np.array([_WIDTH, _HEIGHT]) - 0.05], dtype=np.float64)
                mesh = bpy.data.meshes.new("Studio")
                mesh.from_pydata(rest.tolist(), [], surface.rest.faces.tolist())
                place = fit(every, turn, frame)  # of all of them, so that what stays is seen to stay
                mesh.vertices.foreach_set("co", shape.astype(np.float32).ravel())
                mesh.shade_smooth()
                mesh.update()
                put(scene, mesh, clay, place)
            bpy.data.meshes.remove(every)
        for column, names in enumerate(chosen, 1):
            text = " + ".join(one[0] for one in together(names, keys))
            write(scene, text, (left + _WIDTH * (column + 0.5), 0.1 - top))
        render(scene, path)


def chosen_keys(source: bpy.types.Object, keys: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return six of some keys, (source's name, target's): of each telling expression one, then what moves most."""
    found: list[tuple[str, str]] = []
    for wanted in _TELLING:
        found += [names for names in keys if (known := understood(names[0])) is not None and known[0] == wanted][:1]
    rest = [names for names in keys if names not in found]
    moved = {names: float((key_displacement(source, names[0]) ** 2).sum()) for names in rest}
    found += sorted(rest, key=lambda names: -moved[names])[: _SHOWN - len(found)]
    return [names for names in keys if names in found]


def together(names: tuple[str, str], keys: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the keys that are shown with one: lips that close over an open jaw, as mouthClose does, with that jaw."""
    if understood(names[0]) != ("mouthClose", ""):
        return [names]
    return [names, *[one for one in keys if understood(one[0]) == ("jawOpen", "")][:1]]


def key_displacement(obj: bpy.types.Object, name: str) -> Floats:
    """Return how far a shape key moves each vertex, (n, 3), in the object's own space."""
    key = obj.data.shape_keys.key_blocks[name]
    apart = foreach(key.points, "co", 3, np.float32).astype(np.float64)
    if key.relative_key == obj.data.shape_keys.reference_key:
        return apart - rest_positions(obj.data)
    return apart - foreach(key.relative_key.points, "co", 3, np.float32).astype(np.float64)


def poses(
    source: bpy.types.Object, surfaces: tuple[Surface, Surface], correspondence: Correspondence
) -> tuple[Rotation, Rotation]:
    """Return how to hold both: the source as it is in the scene, the target as that, or as its picture in a mirror."""
    axes: Floats = mirrored(source, np.array(source.matrix_world, dtype=np.float64)[:3, :3])
    own = nearest_orthogonal(axes[None])[0]
    rests = surfaces[0].rest, surfaces[1].rest
    reflected = is_reflected(correspondence, *rests)
    known = correspondence.matched
    if not known.any():
        return Rotation.from_matrix(own), Rotation.from_matrix(own)
    here = places(correspondence, rests[0].vertices)[1][known]
    turn = nearest_orthogonal(own[None] @ superimposing(rests[1].vertices[known], here, mirrored=reflected).turn.T)[0]
    if reflected:  # as in a mirror beside it
        turn = np.diag([-1.0, 1.0, 1.0]) @ turn
    return Rotation.from_matrix(own), Rotation.from_matrix(turn)


def _clay() -> bpy.types.Material:
    """Return a grey material, of one color so that the shape is seen."""
    material = bpy.data.materials.new("Studio clay")
    nodes, links = fresh_tree(material)
    clay = nodes.new("ShaderNodeRGB")
    clay.outputs[0].default_value = (*CLAY, 1.0)
    cover(nodes, links, clay.outputs[0])
    return material
