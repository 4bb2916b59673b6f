"""Which 3D viewport a person looks at, and how it is turned."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Floats


def space_of(context: bpy.types.Context) -> bpy.types.SpaceView3D | None:
    """Return the 3D viewport of the context, or else the largest one; None without a window, as in scripts."""
    if bpy.app.background:
        return None
    if isinstance(context.space_data, bpy.types.SpaceView3D):
        return context.space_data
    area = largest_area(context)
    return area.spaces.active if area is not None else None


def largest_area(context: bpy.types.Context) -> bpy.types.Area | None:
    """Return the largest 3D viewport of the window, or None."""
    areas = context.screen.areas if context.screen is not None else ()
    found = [area for area in areas if area.type == "VIEW_3D"]
    return max(found, key=lambda area: area.width * area.height, default=None)


def viewports(context: bpy.types.Context) -> Iterator[tuple[Any, Any, Any]]:
    """Yield window, area and space of all 3D viewports that are shown."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield window, area, area.spaces.active


def in_viewport(context: bpy.types.Context) -> Any:
    """Return the context of the 3D viewport that `space_of` finds."""
    inside = context.area is not None and context.area.type == "VIEW_3D"
    area: Any = context.area if inside else largest_area(context)
    region = next(region for region in area.regions if region.type == "WINDOW")
    return context.temp_override(area=area, region=region)


def axes_of(space: bpy.types.SpaceView3D | None) -> Floats:
    """Return a view's axes in the world, the front view's without one.

    The rows, (3, 3), point to the right, up, and towards the person.
    """
    if space is None or space.region_3d is None:
        return np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return np.array(space.region_3d.view_rotation.to_matrix()).T
