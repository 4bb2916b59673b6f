"""The demo's two pictures, rendered by Cycles in a scene of their own that is gone afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector
from scipy.spatial.transform import Rotation

from ...solver.surface.mesh import Complexes, Floats
from ..studio.materials import CLAY, cover, darken, flat_material, fresh_tree, glow
from ..studio.scene import fit, light, put, render, studio, write
from ..studio.shapes import rings, upright
from .scans import write_vertices

GRID_LINES = 28


@dataclass(frozen=True)
class Sitter:
    """One head in the group picture.

    Attributes
    ----------
    mesh : bpy.types.Mesh
        What to show.
    material : bpy.types.Material
        What it wears there.
    turn : Rotation
        How to hold it; the camera looks along +Y, with Z upwards.
    caption : str
        What stands below it.
    """

    mesh: bpy.types.Mesh
    material: bpy.types.Material
    turn: Rotation
    caption: str


@dataclass(frozen=True, eq=False)
class Disc:
    """One flattened surface in the picture of the discs.

    Attributes
    ----------
    mesh : bpy.types.Mesh
        The surface.
    material : bpy.types.Material
        What it wears there.
    disc : (n,) complex
        Where each of its vertices lies in the unit disc.
    points : (p,) complex
        The matched points.
    point_colors : (p, 3) float64
        Linear RGB of each.
    caption : str
        What stands below it.
    """

    mesh: bpy.types.Mesh
    material: bpy.types.Material
    disc: Complexes
    points: Complexes
    point_colors: Floats
    caption: str


def render_heads(sitters: Sequence[Sitter], path: Path, *, samples: int = 16) -> None:
    """Render the heads side by side into a PNG file at `path`."""
    width, height = 2.9, 2.8
    with studio(width * len(sitters), height, samples) as scene:
        light(scene, energy=2.6, angle=0.5, rotation=(0.75, 0.15, 0.55))
        light(scene, energy=0.8, angle=1.0, rotation=(1.2, 0.0, -1.0))
        three_quarters = Rotation.from_euler("zx", (-0.22, 0.10))
        for column, sitter in enumerate(sitters):
            left = width * (column - len(sitters) / 2)
            frame = np.array([[left + 0.12, -height / 2 + 0.42], [left + width - 0.12, height / 2 - 0.1]])
            put(scene, sitter.mesh, sitter.material, fit(sitter.mesh, three_quarters * sitter.turn, frame))
            write(scene, sitter.caption, (left + width / 2, -height / 2 + 0.14))
        render(scene, path)


def render_discs(discs: Sequence[Disc], path: Path, *, samples: int = 8) -> None:
    """Render the discs side by side, with the matched points on them, into a PNG file at `path`."""
    spacing, height = 2.3, 2.45
    with studio(spacing * len(discs), height, samples) as scene:
        ink, dot_color = flat_material(None), flat_material("Color")
        for column, disc in enumerate(discs):
            # nearer the camera one after the other: surface, circle, points
            layers = [
                Vector((spacing * (column - (len(discs) - 1) / 2), -depth, 0.1)) for depth in (0.0, 0.1, 0.2, 0.3)
            ]
            surface = put(scene, disc.mesh.copy(), disc.material, Matrix.Translation(layers[0]))
            surface.shape_key_clear()
            write_vertices(surface.data, upright(disc.disc))
            put(scene, rings(np.zeros(1, complex), 0.995, 1.005), ink, Matrix.Translation(layers[1]))
            put(scene, rings(disc.points, 0.0, 0.015), ink, Matrix.Translation(layers[2]))
            put(scene, rings(disc.points, 0.0, 0.010, disc.point_colors), dot_color, Matrix.Translation(layers[3]))
            write(scene, disc.caption, (layers[0].x, -height / 2 + 0.08))
        render(scene, path)


def paint_material(color_attribute: str, uv_map: str, *, lit: bool = True) -> bpy.types.Material:
    """Return a material that shows a color attribute and, as thin dark lines, the grid of a UV map."""
    material = bpy.data.materials.new(color_attribute)
    nodes, links = fresh_tree(material)
    color = nodes.new("ShaderNodeVertexColor")
    color.layer_name = color_attribute
    uv = nodes.new("ShaderNodeUVMap")
    uv.uv_map = uv_map
    cells = nodes.new("ShaderNodeVectorMath")
    cells.operation = "SCALE"
    cells.inputs["Scale"].default_value = GRID_LINES
    links.new(uv.outputs[0], cells.inputs[0])
    axes = nodes.new("ShaderNodeSeparateXYZ")
    links.new(cells.outputs[0], axes.inputs[0])
    distances = []
    for axis in range(2):
        distance = nodes.new("ShaderNodeMath")
        distance.operation = "PINGPONG"
        distance.inputs[1].default_value = 0.5
        links.new(axes.outputs[axis], distance.inputs[0])
        distances.append(distance.outputs[0])
    nearest, is_line = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeMath")
    nearest.operation = "MINIMUM"
    links.new(distances[0], nearest.inputs[0])
    links.new(distances[1], nearest.inputs[1])
    is_line.operation = "LESS_THAN"
    is_line.inputs[1].default_value = 0.045
    links.new(nearest.outputs[0], is_line.inputs[0])
    darkened = darken(nodes, links, color.outputs["Color"], is_line.outputs[0], 0.45)
    (cover if lit else glow)(nodes, links, darkened)
    return material


def clay_material() -> bpy.types.Material:
    """Return a grey material that shows the triangulation."""
    material = bpy.data.materials.new("Clay")
    nodes, links = fresh_tree(material)
    clay = nodes.new("ShaderNodeRGB")
    clay.outputs[0].default_value = (*CLAY, 1.0)
    edges = nodes.new("ShaderNodeWireframe")
    edges.use_pixel_size = True
    edges.inputs[0].default_value = 0.7
    cover(nodes, links, darken(nodes, links, clay.outputs[0], edges.outputs[0], 0.5))
    return material
