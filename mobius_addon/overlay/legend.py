"""What the colors in the viewport mean."""

from __future__ import annotations

import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from gpu_extras.batch import batch_for_shader

from ..heat_maps import Measure, shown_by
from .drawing import floats, free_room, opaque, write


def legends(context: bpy.types.Context) -> list[Measure]:
    """Return what needs a legend in this 3D viewport: the colors that are shown."""
    view = context.window_manager.mobius_view
    found: list[Measure] = []
    shading = context.space_data.shading
    if view.legend and (shading.type not in ("WIREFRAME", "SOLID") or shading.color_type == "VERTEX"):
        for obj in (context.object, context.scene.mobius.target):
            if obj is not None and obj.type == "MESH":
                shown = shown_by(obj.data.attributes.active_color_name or "")
                found += [shown] if shown and shown not in found else []
    return found


def draw_legends() -> None:
    """Draw the legends that this viewport needs, one over the other."""
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    scale, shown = context.preferences.system.ui_scale, legends(context)
    for measure, (left, bottom, width) in zip(shown, corners(len(shown), *free_room(context), scale), strict=False):
        _draw_legend(measure, left, bottom, width, scale)


WIDTH, HEIGHT, GAP = 180, 48, 16
"""Pixels of a legend and between two, times the interface's scale."""


def corners(
    count: int, left: float, bottom: float, right: float, top: float, scale: float
) -> list[tuple[float, float, float]]:
    """Return the lower left corner and the width of each legend that has room, in pixels, all inside what is free.

    They lie over each other, and beside each other where the room is too low; narrower where it is too narrow.
    """
    width, height, gap = min(WIDTH * scale, right - left), HEIGHT * scale, GAP * scale
    rows = max(int((top - bottom + gap) // (height + gap)), 0)
    columns = max(int((right - left + gap) // (width + gap)), 0) if width >= WIDTH * scale / 3 else 0
    return [
        (left + column * (width + gap), bottom + row * (height + gap), width)
        for column in range(columns)
        for row in range(rows)
    ][:count]


def _draw_legend(shown: Measure, left: float, bottom: float, width: float, scale: float) -> None:
    """Draw a bar of the scale's colors, what it shows above, its values below; the corner is in pixels."""
    height, line = 12 * scale, 16 * scale
    x = np.repeat(left + np.linspace(0, width, len(shown.stops)), 2)
    y = np.tile([bottom + line, bottom + line + height], len(shown.stops))
    places = np.column_stack([x, y, np.zeros(len(x))])
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    color = opaque(np.repeat(shown.stops, 2, axis=0), 1.0)
    batch_for_shader(shader, "TRI_STRIP", {"pos": floats(places), "color": floats(color)}).draw(shader)
    write(iface_(shown.title), left, bottom + line + height + 5 * scale)
    for share, tick in zip(np.linspace(0, 1, len(shown.ticks)), shown.ticks, strict=True):
        write(tick, left + share * width, bottom, at=share)
