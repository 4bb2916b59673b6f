"""Matched points, and the lines between them."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...solver import MeshError
from ...solver.surface.mesh import Floats
from ...solver.surface.sampling import spread
from .. import stored_alignment
from ..comparison import copies
from ..mesh_data import Refusal, foreach, read_surface, seen_positions
from ..results import read_layout
from .drawing import LINE_WIDTH, POINT_SIZE, draw_points, floats, on_plane, opaque
from .remembered import remember

LIFT = 0.003
"""How far points are drawn above the surface, as a share of the object's diagonal, so that it does not hide them."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Matched points to draw.

    Attributes
    ----------
    source, target : (k, 3) float64
        Corresponding places in each object's own space, a little above its surface.
    layout : (k, 3) float64
        Where they lie in the shared layout, as UV and 0; no rows if there is none.
    color : (k, 3) float64
        sRGB, another hue for each place.
    """

    source: Floats
    target: Floats
    layout: Floats
    color: Floats


def matches_of(source: bpy.types.Object, target: bpy.types.Object, count: int) -> Matches | None:
    """Return about `count` matched points of an aligned pair, None if there are none or a mesh was edited since."""
    try:
        surfaces = read_surface(source), read_surface(target)
        found = stored_alignment.load(target, source, surfaces)
    except (Refusal, MeshError):
        return None
    matched = np.flatnonzero(found.matched)
    if not len(matched):
        return None
    there = seen_positions(target)
    chosen = matched[spread(there[matched], count)]
    layout = read_layout(target)
    flat = on_plane(layout.disc[chosen]) if layout else np.empty((0, 3))
    return Matches(
        (found.matrix() @ _lifted(source))[chosen],
        _lifted(target)[chosen],
        flat,
        hues(flat if layout else there[chosen]),
    )


def hues(places: Floats) -> Floats:
    """Return sRGB colors, (k, 3), for places, (k, 3): the hues go once around their middle, in even steps.

    Even steps keep many apart; every other one is lighter, so that neighbours are too.
    """
    off = places - places.mean(axis=0)
    flat = off @ np.linalg.eigh(off.T @ off)[1][:, 1:]  # along the two longest axes
    order = np.argsort(np.arctan2(flat[:, 0], flat[:, 1]), kind="stable")
    hue = np.empty(len(places))
    hue[order] = np.arange(len(places)) / len(places)
    light = np.where(np.argsort(order) % 2 == 0, 0.0, 0.45)[:, None]
    full = np.clip(np.abs((6 * hue[:, None] + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0.0, 1.0)
    return np.asarray(full + light * (1 - full), np.float64)


def chosen_matches(context: bpy.types.Context) -> Matches | None:
    """Return the matched points of the chosen pair."""
    chosen = stored_alignment.pair(context)
    if chosen is None:
        return None
    count = context.window_manager.mobius_view.count
    report = hash(chosen[1].data.mobius_alignment.report)
    return remember("matches", chosen, (report, count), lambda: matches_of(*chosen, count))


def draw_matches() -> None:
    """Draw the matched points of the chosen pair, and lines between them."""
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    found = chosen_matches(context)
    chosen = _ends(context)
    if found is None or chosen is None:
        return
    view, scale = context.window_manager.mobius_view, context.preferences.system.ui_scale
    ends = [_moved(places, obj) for places, obj in zip((found.source, found.target), chosen, strict=True)]
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    if view.lines > 0:
        lines = np.stack(ends, axis=1).reshape(-1, 3)
        color = np.repeat(opaque(found.color, view.lines), 2, axis=0)
        shader = gpu.shader.from_builtin("POLYLINE_SMOOTH_COLOR")
        shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        shader.uniform_float("lineWidth", LINE_WIDTH * scale)
        batch_for_shader(shader, "LINES", {"pos": floats(lines), "color": floats(color)}).draw(shader)
    draw_points(np.concatenate(ends), np.concatenate([found.color, found.color]), POINT_SIZE * scale)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def _ends(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object] | None:
    """Return the objects on which the viewport shows the pair: copies side by side, or source and target themselves."""
    for both in (copies(context), stored_alignment.pair(context)):
        if both is not None and all(obj.visible_get(viewport=context.space_data) for obj in both):
            return both
    return None


def _lifted(obj: bpy.types.Object) -> Floats:
    """Return the vertices of an object in its own space, (n, 3), a little above its surface."""
    places = seen_positions(obj)
    height = LIFT * np.linalg.norm(np.ptp(places, axis=0))
    return places + height * foreach(obj.data.vertex_normals, "vector", 3, np.float32)


def _moved(places: Floats, obj: bpy.types.Object) -> Floats:
    """Return points of an object's own space, (k, 3), in the world."""
    matrix = np.array(obj.matrix_world)
    return places @ matrix[:3, :3].T + matrix[:3, 3]
