"""Viewports that look at some objects alone: in local view, until they are told to look as before."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from typing import Any

import bpy

from ...solver.surface.mesh import Floats
from ..comparison import is_copy
from .colors import Shading, forget_shading, shade, shade_later, shading_before, shading_of
from .which import axes_of, in_viewport, space_of, viewports


@dataclass(frozen=True)
class _View:
    """From where a viewport looked and what it showed, before it looked at some objects alone."""

    location: tuple[float, ...]
    rotation: tuple[float, ...]
    distance: float
    perspective: str
    shading: Shading
    overlay: tuple[bool, bool]
    shown: frozenset[int] | None
    """Numbers of the session of the objects that it was in local view of, None if it was in none."""


_alone: dict[int, _View] = {}


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
        with in_viewport(context):
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
    for window, area, space in viewports(context):
        before = _alone.pop(space.as_pointer(), None)
        if before is None:
            continue
        if space.local_view:
            _toggle_in(context, window, area)
        if before.shown is not None:
            _show_alone(context, window, area, before.shown)
        _look(context, space, before)
        if before.shading[1] != "VERTEX":
            shade_later(space, None)


Away = list[tuple[int, _View, _View, Shading | None]]
"""Of each viewport that looked at some objects alone, told by its address: how it looked before, how then, and what
shading it had before it showed our colors."""


def put_away(context: bpy.types.Context) -> Away:
    """Have viewports that look at some objects alone look at all again for a moment; return what `put_back` needs."""
    spaces = [space for _, _, space in viewports(context) if space.as_pointer() in _alone]
    away = [(x.as_pointer(), _alone[x.as_pointer()], _view_of(context, x), shading_before(x)) for x in spaces]
    if away:
        look_at_all_again(context)
    return away


def put_back(context: bpy.types.Context, away: Away, objects: Sequence[bpy.types.Object]) -> None:
    """Have viewports look at these objects alone again, as they did before `put_away`."""
    known = {address: (before, then, shading) for address, before, then, shading in away}
    for window, area, space in viewports(context):
        if space.as_pointer() not in known:
            continue
        before, then, shading = known[space.as_pointer()]
        if not _show_alone(context, window, area, {obj.session_uid for obj in objects}):
            continue
        _look(context, space, then, force=True)
        _alone[space.as_pointer()] = before
        if shading is not None:
            shade_later(space, shading)


def forget_views() -> None:
    """Forget how viewports looked before, and what they showed: they are gone."""
    _alone.clear()
    forget_shading()


def _look(context: bpy.types.Context, space: bpy.types.SpaceView3D, how: _View, *, force: bool = False) -> None:
    """Have a viewport look from where and as it once did; its shading only if it shows our colors, or where forced."""
    view, overlay = space.region_3d, context.window_manager.mobius_view
    view.view_perspective, view.view_rotation = how.perspective, how.rotation
    view.view_location, view.view_distance = how.location, how.distance
    if force:
        space.shading.type, space.shading.color_type = how.shading
    else:
        shade(space, how.shading)
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


def _view_of(context: bpy.types.Context, space: bpy.types.SpaceView3D) -> _View:
    view, overlay = space.region_3d, context.window_manager.mobius_view
    return _View(
        tuple(view.view_location),
        tuple(view.view_rotation),
        view.view_distance,
        view.view_perspective,
        shading_of(space),
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


def _toggle_local_view(context: bpy.types.Context) -> None:
    with in_viewport(context):
        bpy.ops.view3d.localview(frame_selected=False)
