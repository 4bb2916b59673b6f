"""The two discs over each other in a UV editor, and whose is which."""

from __future__ import annotations

from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .. import stored_alignment
from ..results import read_layout
from ..usable import written
from .drawing import POINT_SIZE, draw_points, floats, free_room, on_plane, write
from .matches import chosen_matches
from .remembered import remember

SOURCE_COLOR, TARGET_COLOR = (0.25, 0.62, 1.0), (1.0, 0.55, 0.1)
"""sRGB of the two meshes where they lie over each other."""


def draw_discs() -> None:
    """Draw both discs, and the matched points in them."""
    context = bpy.context
    chosen = stored_alignment.pair(context)
    if context.area.ui_type != "UV" or chosen is None:
        return
    gpu.state.blend_set("ALPHA")
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    report = hash(chosen[1].data.mobius_alignment.report)
    for kind, obj, color in zip(("source", "target"), chosen, (SOURCE_COLOR, TARGET_COLOR), strict=True):
        if obj not in written(*chosen):  # a layout in the source's own file is that of another alignment
            continue
        batch = _layout_batch(kind, obj, report)
        if batch is not None:
            shader.bind()
            shader.uniform_float("color", (*color, 0.4))
            batch.draw(shader)
    found = chosen_matches(context)
    if found is not None and len(found.layout):
        draw_points(found.layout, found.color, POINT_SIZE * context.preferences.system.ui_scale)
    gpu.state.blend_set("NONE")


def _layout_batch(kind: str, obj: bpy.types.Object, report: int) -> Any:
    """Return the edges of an object in the shared layout for the graphics card, None if it has no layout."""

    def make() -> Any:
        layout = read_layout(obj)
        if layout is None:
            return None
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        places = floats(np.nan_to_num(on_plane(layout.disc)))
        return batch_for_shader(shader, "LINES", {"pos": places}, indices=layout.edges)

    return remember(kind, (obj,), (report,), make)


def draw_names() -> None:
    """Say in the UV editor which disc is whose."""
    context = bpy.context
    chosen = stored_alignment.pair(context)
    if context.area.ui_type != "UV" or chosen is None:
        return
    scale = context.preferences.system.ui_scale
    left, bottom, *_ = free_room(context)
    for row, (obj, color) in enumerate(zip(chosen, (SOURCE_COLOR, TARGET_COLOR), strict=True)):
        write(obj.name, left, bottom + 18 * scale * (1 - row), (*color, 1.0))
