"""What viewports show to have our colors seen, and how they looked before."""

from __future__ import annotations

from contextlib import suppress

import bpy

from .which import space_of

Shading = tuple[str, str]
"""Type and color of a viewport's shading."""

# the shading that viewports had before they showed our colors, by their addresses; of the session
_before: dict[int, Shading] = {}

# editors that were opened beside a viewport; of the session
_opened: set[int] = set()


def show_colors(context: bpy.types.Context) -> None:
    """Have the viewport show the active color attributes of meshes, with a legend."""
    space = space_of(context)
    if space is None:
        return
    shading = space.shading
    if shading.type in ("WIREFRAME", "SOLID"):
        if (shading.type, shading.color_type) != ("SOLID", "VERTEX"):
            _before[space.as_pointer()] = shading_of(space)
        shading.type = "SOLID"
        shading.color_type = "VERTEX"
    context.window_manager.mobius_view.legend = True


def show_materials(context: bpy.types.Context) -> None:
    """Have the viewport that shows colors show materials, with their pictures."""
    space = space_of(context)
    if space is not None and space.shading.type == "SOLID":
        space.shading.type = "MATERIAL"


def show_as_before(context: bpy.types.Context) -> None:
    """Undo `show_colors` in every viewport that still shows them, and take the overlay's pictures away."""
    for screen in bpy.data.screens:
        for space in (space for area in screen.areas for space in area.spaces if space.type == "VIEW_3D"):
            if before := _before.pop(space.as_pointer(), None):
                shade(space, before)
    view = context.window_manager.mobius_view
    view.matches = view.discs = view.legend = False
    _close_opened(context)


def close_later(area: bpy.types.Area) -> None:
    """Have `show_as_before` close an editor that was opened beside a viewport."""
    _opened.add(area.as_pointer())


def _close_opened(context: bpy.types.Context) -> None:
    """Close the editors of `close_later` that are still what they were, but for one that this is asked in."""
    for window in context.window_manager.windows:
        for area in list(window.screen.areas):
            if area.as_pointer() in _opened and area.ui_type == "UV" and area != context.area:
                with context.temp_override(window=window, screen=window.screen, area=area), suppress(RuntimeError):
                    bpy.ops.screen.area_close()  # refused where no neighbour has its side
    _opened.clear()


def shading_of(space: bpy.types.SpaceView3D) -> Shading:
    """Return the shading of a viewport."""
    return space.shading.type, space.shading.color_type


def shade(space: bpy.types.SpaceView3D, before: Shading) -> None:
    """Give a viewport that still shows our colors, or materials in their place, other shading."""
    if shading_of(space) in (("SOLID", "VERTEX"), ("MATERIAL", "VERTEX")):
        space.shading.color_type = before[1]
        space.shading.type = before[0]


def shading_before(space: bpy.types.SpaceView3D) -> Shading | None:
    """Return the shading that a viewport had before it showed our colors; None if it does not show them."""
    return _before.get(space.as_pointer())


def shade_later(space: bpy.types.SpaceView3D, shading: Shading | None) -> None:
    """Have `show_as_before` give a viewport this shading, or leave it as it is."""
    if shading is None:
        _before.pop(space.as_pointer(), None)
    else:
        _before[space.as_pointer()] = shading


def forget_shading() -> None:
    """Forget what viewports showed before: they are gone."""
    _before.clear()
    _opened.clear()
