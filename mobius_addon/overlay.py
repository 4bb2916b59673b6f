"""Pictures over the editors: matched points and lines between them, the two discs, and the legend of the colors.

Draw handlers exist only while something is to be seen; opening a file and switching the extension off remove them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from gpu_extras.batch import batch_for_shader

from ..solver import MeshError
from ..solver.surface.mesh import Complexes, Floats
from ..solver.surface.sampling import spread
from . import edits, stored_alignment
from .heat_maps import MAP_MEASURES, Measure, measure, shown_by, srgb
from .mesh_data import Refusal, foreach, read_surface, seen_positions
from .results import read_layout

LIFT = 0.003
"""How far points are drawn above the surface, as a share of the object's diagonal, so that it does not hide them."""

SOURCE_COLOR, TARGET_COLOR = (0.25, 0.62, 1.0), (1.0, 0.55, 0.1)
"""sRGB of the two meshes where they lie over each other."""

POINT_SIZE, LINE_WIDTH = 6.0, 1.5
"""Pixels, times the interface's scale."""


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
        sRGB of the confidence.
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
    confidence = measure("confidence", MAP_MEASURES)
    shares = confidence.shares(found, *(surface.mesh for surface in surfaces))
    layout = read_layout(target)
    return Matches(
        (found.matrix() @ _lifted(source))[chosen],
        _lifted(target)[chosen],
        _on_plane(layout.disc[chosen]) if layout else np.empty((0, 3)),
        srgb(shares[chosen], confidence.stops),
    )


def legends(context: bpy.types.Context) -> list[Measure]:
    """Return what needs a legend in this 3D viewport: colors that are shown, and lines that are drawn."""
    view = context.window_manager.mobius_view
    found: list[Measure] = []
    shading = context.space_data.shading
    if view.legend and (shading.type not in ("WIREFRAME", "SOLID") or shading.color_type == "VERTEX"):
        for obj in (context.object, context.scene.mobius.target):
            if obj is not None and obj.type == "MESH":
                shown = shown_by(obj.data.attributes.active_color_name or "")
                found += [shown] if shown and shown not in found else []
    confidence = measure("confidence", MAP_MEASURES)
    if view.matches and confidence not in found and pair(context):
        found.append(confidence)
    return found


def pair(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object] | None:
    """Return the chosen source and target if they are aligned."""
    settings = context.scene.mobius
    source, target = settings.source, settings.target
    if source is None or target is None or source.type != "MESH" or target.type != "MESH":
        return None
    return (source, target) if stored_alignment.exists(target, source) else None


def follow(context: bpy.types.Context) -> None:
    """Draw what the session's view asks for, and nothing else."""
    view = context.window_manager.mobius_view
    wanted = {"matches": view.matches, "legend": view.matches or view.legend, "discs": view.discs, "names": view.discs}
    for name, (space, kind, draw) in _PICTURES.items():
        if wanted[name] and name not in _handles:
            _handles[name] = space.draw_handler_add(draw, (), "WINDOW", kind)
        elif not wanted[name] and name in _handles:
            space.draw_handler_remove(_handles.pop(name), "WINDOW")
    if not _handles:
        _forget(None)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "IMAGE_EDITOR"):
                area.tag_redraw()


@dataclass(frozen=True, eq=False)
class _Picture:
    """Something to draw, with the meshes (session uids) and the choices it was made from."""

    meshes: tuple[int, ...]
    made_for: tuple[int, ...]
    content: Any


# a cache, never the truth: it can be emptied at any time
_remembered: dict[str, _Picture] = {}
_handles: dict[str, Any] = {}


def _remember(
    kind: str, objects: tuple[bpy.types.Object, ...], made_for: tuple[int, ...], make: Callable[[], Any]
) -> Any:
    """Return what `make` returned, until an object or a choice is another one or a mesh was edited."""
    meshes = tuple(obj.data.session_uid for obj in objects)
    known = _remembered.get(kind)
    if known is None or (known.meshes, known.made_for) != (meshes, made_for):
        if any(obj.mode == "EDIT" for obj in objects):  # its mesh cannot be read
            return None
        known = _remembered[kind] = _Picture(meshes, made_for, make())
    return known.content


def _forget(edited: int | None) -> None:
    for kind in [kind for kind, known in _remembered.items() if edited is None or edited in known.meshes]:
        del _remembered[kind]


def _lifted(obj: bpy.types.Object) -> Floats:
    """Return the vertices of an object in its own space, (n, 3), a little above its surface."""
    places = seen_positions(obj)
    height = LIFT * np.linalg.norm(np.ptp(places, axis=0))
    return places + height * foreach(obj.data.vertex_normals, "vector", 3, np.float32)


def _chosen_matches(context: bpy.types.Context) -> Matches | None:
    """Return the matched points of the chosen pair."""
    chosen = pair(context)
    if chosen is None:
        return None
    count = context.window_manager.mobius_view.count
    report = hash(chosen[1].data.mobius_alignment.report)
    return _remember("matches", chosen, (report, count), lambda: matches_of(*chosen, count))


def _draw_matches() -> None:
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    found = _chosen_matches(context)
    chosen = pair(context)
    if found is None or chosen is None:
        return
    if not all(obj.visible_get(viewport=context.space_data) for obj in chosen):
        return
    view, scale = context.window_manager.mobius_view, context.preferences.system.ui_scale
    ends = [_moved(places, obj) for places, obj in zip((found.source, found.target), chosen, strict=True)]
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    if view.lines > 0:
        lines = np.stack(ends, axis=1).reshape(-1, 3)
        color = np.repeat(_opaque(found.color, view.lines), 2, axis=0)
        shader = gpu.shader.from_builtin("POLYLINE_SMOOTH_COLOR")
        shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        shader.uniform_float("lineWidth", LINE_WIDTH * scale)
        batch_for_shader(shader, "LINES", {"pos": _floats(lines), "color": _floats(color)}).draw(shader)
    _draw_points(np.concatenate(ends), np.concatenate([found.color, found.color]), POINT_SIZE * scale)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def _draw_discs() -> None:
    context = bpy.context
    chosen = pair(context)
    if context.area.ui_type != "UV" or chosen is None:
        return
    gpu.state.blend_set("ALPHA")
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    report = hash(chosen[1].data.mobius_alignment.report)
    for kind, obj, color in zip(("source", "target"), chosen, (SOURCE_COLOR, TARGET_COLOR), strict=True):
        batch = _layout_batch(kind, obj, report)
        if batch is not None:
            shader.bind()
            shader.uniform_float("color", (*color, 0.4))
            batch.draw(shader)
    found = _chosen_matches(context)
    if found is not None and len(found.layout):
        _draw_points(found.layout, found.color, POINT_SIZE * context.preferences.system.ui_scale)
    gpu.state.blend_set("NONE")


def _layout_batch(kind: str, obj: bpy.types.Object, report: int) -> Any:
    """Return the edges of an object in the shared layout for the graphics card, None if it has no layout."""

    def make() -> Any:
        layout = read_layout(obj)
        if layout is None:
            return None
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        places = _floats(np.nan_to_num(_on_plane(layout.disc)))
        return batch_for_shader(shader, "LINES", {"pos": places}, indices=layout.edges)

    return _remember(kind, (obj,), (report,), make)


def _draw_names() -> None:
    """Say in the UV editor which disc is whose."""
    context = bpy.context
    chosen = pair(context)
    if context.area.ui_type != "UV" or chosen is None:
        return
    scale = context.preferences.system.ui_scale
    left, bottom = _free_corner(context)
    for row, (obj, color) in enumerate(zip(chosen, (SOURCE_COLOR, TARGET_COLOR), strict=True)):
        _write(obj.name, left, bottom + 18 * scale * (1 - row), (*color, 1.0))


def _draw_legends() -> None:
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    scale = context.preferences.system.ui_scale
    left, bottom = _free_corner(context)
    for shown in legends(context):
        _draw_legend(shown, left, bottom, scale)
        bottom += 64 * scale


def _draw_legend(shown: Measure, left: float, bottom: float, scale: float) -> None:
    """Draw a bar of the scale's colors, what it shows above, its values below; the corner is in pixels."""
    width, height, line = 180 * scale, 12 * scale, 16 * scale
    x = np.repeat(left + np.linspace(0, width, len(shown.stops)), 2)
    y = np.tile([bottom + line, bottom + line + height], len(shown.stops))
    corners = np.column_stack([x, y, np.zeros(len(x))])
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    color = _opaque(np.repeat(shown.stops, 2, axis=0), 1.0)
    batch_for_shader(shader, "TRI_STRIP", {"pos": _floats(corners), "color": _floats(color)}).draw(shader)
    _write(iface_(shown.title), left, bottom + line + height + 5 * scale)
    for share, tick in zip(np.linspace(0, 1, len(shown.ticks)), shown.ticks, strict=True):
        _write(tick, left + share * width, bottom, at=share)


def _write(text: str, x: float, y: float, color: tuple[float, ...] = (1, 1, 1, 1), *, at: float = 0.0) -> None:
    """Write a text; `at` is the share of its width that lies left of x."""
    scale = bpy.context.preferences.system.ui_scale
    blf.size(0, 11 * scale)
    blf.color(0, *color)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0, 0, 0, 0.8)
    blf.position(0, x - at * blf.dimensions(0, text)[0], y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)


def _free_corner(context: bpy.types.Context) -> tuple[float, float]:
    """Return the lower left corner, in pixels of the region, that nothing of Blender's own lies over."""
    scale = context.preferences.system.ui_scale
    over = context.preferences.system.use_region_overlap
    left = bottom = 20 * scale
    for region in context.area.regions:
        if over and region.type == "TOOLS" and region.alignment == "LEFT":
            left += region.width
        elif over and region.type.startswith(("ASSET_SHELF", "HUD")) and region.height > 1:
            bottom += region.height
    return left, bottom


def _draw_points(places: Floats, color: Floats, size: float) -> None:
    """Draw points, (k, 3), in sRGB colors, (k, 3), `size` pixels wide."""
    shader = _point_shader()
    batch = batch_for_shader(shader, "POINTS", {"pos": _floats(places), "color": _floats(_opaque(color, 1.0))})
    if bpy.app.version >= (4, 5, 0):
        shader.uniform_float("size", size)
    else:
        gpu.state.point_size_set(size)
    batch.draw(shader)


def _point_shader() -> gpu.types.GPUShader:
    """Return the shader of points: from 4.5 on one that knows their size, which Vulkan and Metal need."""
    return gpu.shader.from_builtin("POINT_FLAT_COLOR" if bpy.app.version >= (4, 5, 0) else "FLAT_COLOR")


def _moved(places: Floats, obj: bpy.types.Object) -> Floats:
    """Return points of an object's own space, (k, 3), in the world."""
    matrix = np.array(obj.matrix_world)
    return places @ matrix[:3, :3].T + matrix[:3, 3]


def _on_plane(disc: Complexes) -> Floats:
    """Return points of the unit disc, (k,), where a UV editor draws them, (k, 3)."""
    return np.column_stack([disc.real / 2 + 0.5, disc.imag / 2 + 0.5, np.zeros(len(disc))])


def _opaque(color: Floats, alpha: float) -> Floats:
    return np.column_stack([color, np.full(len(color), alpha)])


def _floats(values: Floats) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)


_PICTURES: dict[str, tuple[Any, str, Callable[[], None]]] = {
    "matches": (bpy.types.SpaceView3D, "POST_VIEW", _draw_matches),
    "legend": (bpy.types.SpaceView3D, "POST_PIXEL", _draw_legends),
    "discs": (bpy.types.SpaceImageEditor, "POST_VIEW", _draw_discs),
    "names": (bpy.types.SpaceImageEditor, "POST_PIXEL", _draw_names),
}


@bpy.app.handlers.persistent
def _hide_all(*_: object) -> None:
    """Begin a file without pictures."""
    view = bpy.context.window_manager.mobius_view
    view.matches = view.discs = view.legend = False


def register() -> None:
    """Watch for edits and for other files."""
    edits.listen(_forget)
    bpy.app.handlers.load_post.append(_hide_all)


def unregister() -> None:
    """Remove every draw handler."""
    bpy.app.handlers.load_post.remove(_hide_all)
    edits.ignore(_forget)
    for name in list(_handles):
        _PICTURES[name][0].draw_handler_remove(_handles.pop(name), "WINDOW")
    _remembered.clear()
