"""The 3D viewport that a person looks at: what it shows, and from where."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ..solver.surface.mesh import Floats
from .comparison import is_copy

# type and color of the shading that viewports had before they showed our colors; of the session
_before: dict[int, tuple[str, str]] = {}


@dataclass(frozen=True)
class _View:
    """From where a viewport looked and what it showed, before it looked at some objects alone."""

    location: tuple[float, ...]
    rotation: tuple[float, ...]
    distance: float
    perspective: str
    shading: tuple[str, str]
    overlay: tuple[bool, bool]
    shown: frozenset[int] | None
    """Numbers of the session of the objects that it was in local view of, None if it was in none."""


_alone: dict[int, _View] = {}

# editors that were opened beside a viewport; of the session
_opened: set[int] = set()


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


def show_colors(context: bpy.types.Context) -> None:
    """Have the viewport show the active color attributes of meshes, with a legend."""
    space = space_of(context)
    if space is None:
        return
    shading = space.shading
    if shading.type in ("WIREFRAME", "SOLID"):
        if (shading.type, shading.color_type) != ("SOLID", "VERTEX"):
            _before[space.as_pointer()] = shading.type, shading.color_type
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
                _shade(space, before)
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


def _shade(space: bpy.types.SpaceView3D, before: tuple[str, str]) -> None:
    """Give a viewport that still shows our colors, or materials in their place, other shading."""
    if (space.shading.type, space.shading.color_type) in (("SOLID", "VERTEX"), ("MATERIAL", "VERTEX")):
        space.shading.color_type = before[1]
        space.shading.type = before[0]


def forget_views() -> None:
    """Forget what viewports showed before: they are gone."""
    _before.clear()
    _alone.clear()
    _opened.clear()


def axes_of(space: bpy.types.SpaceView3D | None) -> Floats:
    """Return a view's axes in the world, the front view's without one.

    The rows, (3, 3), point to the right, up, and towards the person.
    """
    if space is None or space.region_3d is None:
        return np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return np.array(space.region_3d.view_rotation.to_matrix()).T


def look_at_selected_alone(context: bpy.types.Context, places: Floats) -> None:
    """Show the selected objects alone, with points of the world, (k, 3), filling the part of the viewport that is free.

    Nothing is done without a window.
    """
    space = space_of(context)
    if space is not None:
        _alone.setdefault(space.as_pointer(), _view_of(context, space))
        if space.local_view:
            _toggle_local_view(context)
        _toggle_local_view(context)
        with _in_viewport(context):
            _fill(bpy.context, places)


def _fill(context: bpy.types.Context, places: Floats) -> None:
    """Move the view so that points fill what toolbar and sidebar leave of it."""
    region, view = context.region, context.space_data.region_3d
    over = {"LEFT": 0, "RIGHT": 0}
    if context.preferences.system.use_region_overlap:
        for other in context.area.regions:
            if other.type in ("TOOLS", "UI") and other.alignment in over:
                over[other.alignment] += other.width
    axes = axes_of(context.space_data)
    low, high = (places @ axes.T).min(axis=0), (places @ axes.T).max(axis=0)
    # what is seen at the distance of the middle: 72 mm, Blender's film, by the lens; it fits the longer side
    free = max(region.width - over["LEFT"] - over["RIGHT"], region.width / 4)
    longer = max(region.width, region.height)
    size = 1.15 * max((high[0] - low[0]) / free, (high[1] - low[1]) / region.height) * longer
    middle = (low + high) / 2
    middle[0] += size / longer * (over["RIGHT"] - over["LEFT"]) / 2
    view.view_location = middle @ axes
    view.view_distance = size * context.space_data.lens / 72 + (high[2] - low[2]) / 2


def looks_at_some_alone() -> bool:
    """Return whether a viewport was made to look at some objects alone, and was not told to look at all again."""
    return bool(_alone)


def look_at_all_again(context: bpy.types.Context) -> None:
    """Leave the view of some objects alone in every viewport that was made to look so; show all as it was before."""
    if not _alone and (space := space_of(context)) is not None and space.local_view:
        shown = _shown_alone(context, space)  # of copies, since a file was opened; what a person looks at stays
        if all(is_copy(obj) for obj in context.view_layer.objects if obj.session_uid in shown):
            _toggle_local_view(context)
    for window, area, space in _viewports(context):
        before = _alone.pop(space.as_pointer(), None)
        if before is None:
            continue
        if space.local_view:
            _toggle_in(context, window, area)
        if before.shown is not None:
            _show_alone(context, window, area, before.shown)
        _look(context, space, before)
        if before.shading[1] != "VERTEX":
            _before.pop(space.as_pointer(), None)


Away = list[tuple[int, _View, _View, tuple[str, str] | None]]
"""Of each viewport that looked at some objects alone, told by its address: how it looked before, how then, and what
shading it had before it showed our colors."""


def put_away(context: bpy.types.Context) -> Away:
    """Have viewports that look at some objects alone look at all again for a moment; return what `put_back` needs."""
    spaces = [space for _, _, space in _viewports(context) if space.as_pointer() in _alone]
    away = [(x.as_pointer(), _alone[x.as_pointer()], _view_of(context, x), _before.get(x.as_pointer())) for x in spaces]
    if away:
        look_at_all_again(context)
    return away


def put_back(context: bpy.types.Context, away: Away, objects: Sequence[bpy.types.Object]) -> None:
    """Have viewports look at these objects alone again, as they did before `put_away`."""
    known = {address: (before, then, shading) for address, before, then, shading in away}
    for window, area, space in _viewports(context):
        if space.as_pointer() not in known:
            continue
        before, then, shading = known[space.as_pointer()]
        if not _show_alone(context, window, area, {obj.session_uid for obj in objects}):
            continue
        _look(context, space, then, force=True)
        _alone[space.as_pointer()] = before
        if shading is not None:
            _before[space.as_pointer()] = shading


def _look(context: bpy.types.Context, space: bpy.types.SpaceView3D, how: _View, *, force: bool = False) -> None:
    """Have a viewport look from where and as it once did; its shading only if it shows our colors, or where forced."""
    view, overlay = space.region_3d, context.window_manager.mobius_view
    view.view_perspective, view.view_rotation = how.perspective, how.rotation
    view.view_location, view.view_distance = how.location, how.distance
    if force:
        space.shading.type, space.shading.color_type = how.shading
    else:
        _shade(space, how.shading)
    overlay.matches, overlay.legend = how.overlay


def _toggle_in(context: bpy.types.Context, window: bpy.types.Window, area: bpy.types.Area) -> None:
    """Enter the local view of an area's viewport, or leave it."""
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.localview(frame_selected=False)


def _show_alone(context: bpy.types.Context, window: Any, area: Any, shown: Set[int]) -> bool:
    """Have an area's viewport be in local view of objects, by their numbers of the session; return whether it is."""
    space, layer = area.spaces.active, window.view_layer
    there = [obj for obj in layer.objects if obj.session_uid in shown]
    if not space.local_view and there:
        was_selected = there[0].select_get(view_layer=layer)
        there[0].select_set(True, view_layer=layer)  # Blender enters it with what is selected, and not with nothing
        _toggle_in(context, window, area)
        there[0].select_set(was_selected, view_layer=layer)
    if not space.local_view:
        return False
    for obj in layer.objects:
        obj.local_view_set(space, obj in there)
    return True


def _viewports(context: bpy.types.Context) -> Iterator[tuple[Any, Any, Any]]:
    """Yield window, area and space of all 3D viewports that are shown."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield window, area, area.spaces.active


def _view_of(context: bpy.types.Context, space: bpy.types.SpaceView3D) -> _View:
    view, overlay = space.region_3d, context.window_manager.mobius_view
    return _View(
        tuple(view.view_location),
        tuple(view.view_rotation),
        view.view_distance,
        view.view_perspective,
        (space.shading.type, space.shading.color_type),
        (overlay.matches, overlay.legend),
        _shown_alone(context, space) if space.local_view else None,
    )


def _shown_alone(context: bpy.types.Context, space: bpy.types.SpaceView3D) -> frozenset[int]:
    """Return the numbers of the session of the objects that a local view shows."""
    drawn = context.evaluated_depsgraph_get()  # without a window Blender knows it of evaluated objects only
    either = ((obj, obj.evaluated_get(drawn)) for obj in context.view_layer.objects)
    return frozenset(
        obj.session_uid for obj, shown in either if obj.local_view_get(space) or shown.local_view_get(space)
    )


def edit(context: bpy.types.Context, obj: bpy.types.Object, *, look: bool = True) -> str | None:
    """Go to Edit Mode of an object alone and, where there is a window, look at what is selected of it if asked to.

    Returns
    -------
    str or None
        Why that is not possible, and nothing was done; None if it was.
    """
    layer, space = context.view_layer, space_of(context)
    layer.update()
    if layer.objects.get(obj.name) != obj:
        text = rpt_("'{}' is in no collection of this view layer: include its collection in the Outliner to see them")
        return text.format(obj.name)
    hidden = obj.hide_get()
    obj.hide_set(False)
    if not obj.visible_get():
        obj.hide_set(hidden)
        text = rpt_("'{}' is disabled in viewports, or its collection is hidden: show it in the Outliner to see them")
        return text.format(obj.name)
    if space is not None and space.local_view:
        obj.local_view_set(space, True)
    for other in layer.objects:  # what is selected would go to Edit Mode too
        other.select_set(other == obj)
    layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    if look:
        look_at_selected(context)
    return None


def look_at_selected(context: bpy.types.Context) -> None:
    """Have the viewport, where there is one, look at what is selected."""
    if space_of(context) is not None:
        with _in_viewport(context):
            bpy.ops.view3d.view_selected()


def _toggle_local_view(context: bpy.types.Context) -> None:
    with _in_viewport(context):
        bpy.ops.view3d.localview(frame_selected=False)


def _in_viewport(context: bpy.types.Context) -> Any:
    """Return the context of the 3D viewport that `space_of` finds."""
    inside = context.area is not None and context.area.type == "VIEW_3D"
    area: Any = context.area if inside else largest_area(context)
    region = next(region for region in area.regions if region.type == "WINDOW")
    return context.temp_override(area=area, region=region)
