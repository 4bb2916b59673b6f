"""Drawn on discs and spheres: dots and rings, and the colors of points."""

from __future__ import annotations

import bpy
import numpy as np

from ...solver.surface.mesh import Complexes, Floats, Integers


def rings(centres: Complexes, inner: float, outer: float, colors: Floats | None = None) -> bpy.types.Mesh:
    """Return a round ring about each centre (p,), in one mesh; a filled dot where `inner` is 0."""
    turns = 24 if inner == 0 else 180
    circle = np.exp(2j * np.pi * np.arange(turns) / turns)
    ring = np.concatenate([inner * circle, outer * circle])
    k = np.arange(turns)
    after = (k + 1) % turns
    quads = np.stack([k, k + turns, after + turns, after], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    offsets = np.arange(len(centres))[:, None, None] * len(ring)
    places = (np.asarray(centres)[:, None] + ring).ravel()
    shade = np.zeros((len(centres), 3)) if colors is None else colors
    return colored_mesh(upright(places), (triangles + offsets).reshape(-1, 3), np.repeat(shade, len(ring), axis=0))


def colored_mesh(vertices: Floats, triangles: Integers, colors: Floats) -> bpy.types.Mesh:
    """Return a mesh with the color attribute "Color"."""
    mesh = bpy.data.meshes.new("Studio")
    mesh.from_pydata(vertices.tolist(), [], triangles.tolist())
    rgba = np.column_stack([colors, np.ones(len(colors))]).astype(np.float32)
    mesh.color_attributes.new("Color", "FLOAT_COLOR", "POINT").data.foreach_set("color", rgba.ravel())
    return mesh


def upright(places: Complexes) -> Floats:
    """Return points of the complex plane as points of the XZ plane, (n, 3)."""
    return np.column_stack([places.real, np.zeros(len(places)), places.imag])


def hues(points: Complexes) -> Floats:
    """Return a color per point, (p, 3): its angle as the hue, paler towards the middle."""
    phases = np.angle(points)[:, None] - 2 * np.pi * np.arange(3) / 3
    return 1 - np.minimum(1, 0.25 + np.abs(points))[:, None] * (0.5 - 0.5 * np.cos(phases))
