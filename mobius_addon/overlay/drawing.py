"""Points, texts and places in a region, as every picture draws them."""

from __future__ import annotations

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...solver.surface.mesh import Complexes, Floats

POINT_SIZE, LINE_WIDTH = 6.0, 1.5
"""Pixels, times the interface's scale."""


def write(text: str, x: float, y: float, color: tuple[float, ...] = (1, 1, 1, 1), *, at: float = 0.0) -> None:
    """Write a text; `at` is the share of its width that lies left of x."""
    scale = bpy.context.preferences.system.ui_scale
    blf.size(0, 11 * scale)
    blf.color(0, *color)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0, 0, 0, 0.8)
    blf.position(0, x - at * blf.dimensions(0, text)[0], y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)


def free_room(context: bpy.types.Context) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top, in pixels of the region, of what nothing of Blender's own lies over."""
    scale = context.preferences.system.ui_scale
    over = context.preferences.system.use_region_overlap
    left = bottom = 20 * scale
    right, top = context.region.width - 20 * scale, context.region.height - 20 * scale
    for region in context.area.regions:
        if over and region.type == "TOOLS" and region.alignment == "LEFT":
            left += region.width
        elif over and region.type == "UI" and region.alignment == "RIGHT":
            right -= region.width
        elif over and region.type in ("HEADER", "TOOL_HEADER") and region.alignment == "TOP":
            top -= region.height
        elif over and region.type.startswith(("ASSET_SHELF", "HUD")) and region.height > 1:
            bottom += region.height
    return left, bottom, right, top


def draw_points(places: Floats, color: Floats, size: float) -> None:
    """Draw points, (k, 3), in sRGB colors, (k, 3), `size` pixels wide."""
    shader = _point_shader()
    batch = batch_for_shader(shader, "POINTS", {"pos": floats(places), "color": floats(opaque(color, 1.0))})
    if bpy.app.version >= (4, 5, 0):
        shader.uniform_float("size", size)
    else:
        gpu.state.point_size_set(size)
    batch.draw(shader)


def _point_shader() -> gpu.types.GPUShader:
    """Return the shader of points: from 4.5 on one that knows their size, which Vulkan and Metal need."""
    return gpu.shader.from_builtin("POINT_FLAT_COLOR" if bpy.app.version >= (4, 5, 0) else "FLAT_COLOR")


def on_plane(disc: Complexes) -> Floats:
    """Return points of the unit disc, (k,), where a UV editor draws them, (k, 3)."""
    return np.column_stack([disc.real / 2 + 0.5, disc.imag / 2 + 0.5, np.zeros(len(disc))])


def opaque(color: Floats, alpha: float) -> Floats:
    """Return colors, (k, 3), with an alpha, (k, 4)."""
    return np.column_stack([color, np.full(len(color), alpha)])


def floats(values: Floats) -> np.ndarray:
    """Return values as the graphics card takes them."""
    return np.ascontiguousarray(values, np.float32)
