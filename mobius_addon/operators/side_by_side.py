"""Source and target beside each other, in one pose, with one pattern carried by the alignment."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from mathutils import Matrix

from ...solver import Correspondence, MeshError
from ...solver.surface.mesh import Complexes, Floats
from ...solver.surface.superimposing import superimposing
from .. import comparison, stored_alignment, viewport
from ..attributes import PATTERN_COLOR
from ..comparison import add, copies, end, is_shown
from ..mesh_data import Refusal, Surface, read_surface, seen_positions, settle
from ..options import transfer_settings
from ..preferences import preferences
from ..results import pattern_color, read_layout, require_room, write_color
from ..textures.preview import preview_settings, show_preview
from ..textures.writing import has_pictures
from ..translation import told
from ..usable import is_read_only, why_not_aligned, why_not_object_mode
from .transfer import read_through

GAP = 0.15
"""Between the two, as a share of the wider one's width."""


class MOBIUS_OT_side_by_side(bpy.types.Operator):
    """Show copies of source and target beside each other, in one pose, with a pattern or pictures that were carried."""

    bl_idname = "mobius.side_by_side"
    bl_label = "Side by Side"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that have been aligned."""
        reason = why_not_aligned(context, writes_source=True)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Paint both meshes and put copies beside each other."""
        settle(context)
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            surfaces, found = show(context, source, target)
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        self._preview(context, source, target, surfaces, found)
        return {"FINISHED"}

    def _preview(
        self,
        context: bpy.types.Context,
        source: bpy.types.Object,
        target: bpy.types.Object,
        surfaces: tuple[Surface, Surface],
        found: Correspondence,
    ) -> None:
        """Show on the copy of the target what a transfer of textures would, if they are to be transferred."""
        settings, shown = preview_settings(transfer_settings(context.scene.mobius)), copies(context)
        if settings is None or shown is None or has_pictures(target):
            return
        try:
            if show_preview(shown[1], read_through(source, target, surfaces, found, settings).carry()):
                viewport.show_materials(context)
        except (Refusal, MeshError) as error:
            self.report({"WARNING"}, rpt_("No preview of the textures: {}").format(told(str(error))))


def paint(source: bpy.types.Object, target: bpy.types.Object) -> tuple[tuple[Surface, Surface], Correspondence]:
    """Paint both meshes of an aligned pair with one pattern, as active color attributes; return what they are.

    Raises
    ------
    Refusal, MeshError
        They are not what was aligned any more, or have no room for the colors.
    """
    surfaces = read_surface(source), read_surface(target)
    found = stored_alignment.load(target, source, surfaces)
    hues = _hues(source, target, surfaces, found)
    for obj in (source, target):
        require_room(obj, [], [PATTERN_COLOR])
    on_source = surfaces[0].mesh.vertices / np.linalg.norm(np.ptp(surfaces[0].mesh.vertices, axis=0))
    for obj, hue, there in zip((source, target), hues, (on_source, found.matrix() @ on_source), strict=True):
        known = np.isfinite(hue)
        write_color(obj, PATTERN_COLOR, pattern_color(np.where(known, hue, 0), there), known)
    return surfaces, found


def show(
    context: bpy.types.Context, source: bpy.types.Object, target: bpy.types.Object
) -> tuple[tuple[Surface, Surface], Correspondence]:
    """Show an aligned pair as copies beside each other, in one pose, both upright or mirrored as the map says.

    What it is, is returned.

    Raises
    ------
    Refusal, MeshError
        As `paint`.
    """
    surfaces, found = paint(source, target)
    mirrored = target.data.mobius_alignment.reflected
    places = [_world(obj) for obj in (source, target)]
    some = found.matched if found.matched.any() else found.face >= 0
    fixed = (found.matrix() @ places[0])[some]
    pose = superimposing(places[1][some], fixed, mirrored=mirrored, scaled=True).matrix
    right = viewport.axes_of(viewport.space_of(context))[0]
    posed = places[1] @ pose[:3, :3].T + pose[:3, 3]
    step = _beside(places[0] @ right, posed @ right)
    viewport.look_at_all_again(context)
    end(context)
    moved = Matrix.Translation(right * step) @ Matrix(pose.tolist()) @ target.matrix_world
    for obj, role, matrix in ((source, "source", source.matrix_world), (target, "target", moved)):
        name = rpt_("{} (side by side, mirrored)") if mirrored and obj == target else rpt_("{} (side by side)")
        add(context, obj, role, name.format(obj.name), matrix)
    comparison.remember_selection(context)
    look(context)
    viewport.show_colors(context)
    if has_pictures(target):
        viewport.show_materials(context)
    return surfaces, found


def show_after(context: bpy.types.Context, source: bpy.types.Object, target: bpy.types.Object) -> None:
    """Show the new alignment of a pair as the preferences say, where a 3D viewport is there to see it in.

    Raises
    ------
    Refusal, MeshError
        As `paint`.
    """
    kept = preferences(context)
    how = kept.after_align if kept is not None else "side_by_side"
    if how == "nothing" or viewport.space_of(context) is None:
        return
    if is_read_only(source):  # it cannot be painted, and is seen where it is
        context.window_manager.mobius_view.matches = True
    elif how == "pattern":
        paint(source, target)
        viewport.show_colors(context)
    else:
        show(context, source, target)
        context.window_manager.mobius_view.matches = True


def look(context: bpy.types.Context) -> None:
    """Have the viewport look at the copies alone."""
    found = copies(context)
    if found is None:
        return
    context.view_layer.update()  # what is new can be selected from then on
    for obj in context.view_layer.objects:
        obj.select_set(obj in found)
    context.view_layer.objects.active = found[1]
    viewport.look_at_selected_alone(context, np.concatenate([_world(obj) for obj in found]))


class MOBIUS_OT_end_side_by_side(bpy.types.Operator):
    """Remove the copies that Side by Side made and return to the whole scene."""

    bl_idname = "mobius.end_side_by_side"
    bl_label = "End Side by Side"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow where the copies are."""
        reason = why_not_object_mode(context) if is_shown(context) else rpt_("Nothing is shown side by side")
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the copies; what was selected and shown before is so again."""
        leave(context)
        return {"FINISHED"}


def _hues(source: Any, target: Any, surfaces: Sequence[Surface], found: Correspondence) -> tuple[Complexes, Complexes]:
    """Return points of the unit disc that tell the vertices of both apart, nan where there is none.

    They are those of the shared layout. Closed surfaces have none: of them it is the source seen along its y axis.
    """
    mesh = surfaces[0].mesh
    if all((surface.mesh.twins >= 0).all() for surface in surfaces):
        middle = (mesh.vertices.max(axis=0) + mesh.vertices.min(axis=0)) / 2
        seen = (mesh.vertices - middle) @ np.array([1, 0, 1j]) * (2 / mesh.diagonal)
        return seen, np.where(found.face >= 0, found.matrix() @ seen, np.nan)
    layouts = read_layout(source), read_layout(target)
    if layouts[0] is None or layouts[1] is None:
        raise Refusal(rpt_("The shared layout was removed: press Align again"))
    return layouts[0].disc, layouts[1].disc


def leave(context: bpy.types.Context) -> None:
    """Remove the copies, and have viewports look as they did before."""
    viewport.look_at_all_again(context)
    end(context)


def _beside(first: Floats, second: Floats) -> float:
    """Return how far the second has to be moved along an axis, of which both take these coordinates, to lie behind."""
    return float(first.max() - second.min() + GAP * max(np.ptp(first), np.ptp(second)))


def _world(obj: bpy.types.Object) -> Floats:
    """Return the vertices of an object in the world, (n, 3)."""
    matrix = np.array(obj.matrix_world)
    return seen_positions(obj) @ matrix[:3, :3].T + matrix[:3, 3]
