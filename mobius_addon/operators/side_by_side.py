"""Source and target beside each other, in one pose, with one pattern carried by the alignment."""

from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from mathutils import Matrix

from ...solver import Correspondence, MeshError
from ...solver.carry.fitted import similarity
from ...solver.surface.mesh import Floats
from .. import stored_alignment, viewport
from ..attributes import PATTERN_COLOR
from ..mesh_data import Refusal, read_surface, seen_positions
from ..options import transfer_settings
from ..results import pattern_color, read_layout, require_room, write_color
from ..textures.preview import is_preview_of, preview_settings, remove_preview, show_preview
from ..textures.writing import has_pictures
from ..usable import why_not_aligned
from .transfer import read_through

COLLECTION = "Mobius Side by Side"

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
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            surfaces = read_surface(source), read_surface(target)
            found = stored_alignment.load(target, source, surfaces)
            layouts = read_layout(source), read_layout(target)
            if layouts[0] is None or layouts[1] is None:
                raise Refusal(rpt_("The shared layout was removed: press Align again"))
            for obj in (source, target):
                require_room(obj, [], [PATTERN_COLOR])
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        on_source = surfaces[0].mesh.vertices / np.linalg.norm(np.ptp(surfaces[0].mesh.vertices, axis=0))
        for obj, layout, there in ((source, layouts[0], on_source), (target, layouts[1], found.matrix() @ on_source)):
            known = np.isfinite(layout.disc)
            write_color(obj, PATTERN_COLOR, pattern_color(np.where(known, layout.disc, 0), there), known)
        places = [_world(obj) for obj in (source, target)]
        some = found.matched if found.matched.any() else found.face >= 0
        pose = similarity(places[1][some], (found.matrix() @ places[0])[some])
        right = viewport.axes_of(viewport.space_of(context))[0]
        posed = places[1] @ pose[:3, :3].T + pose[:3, 3]
        step = _beside(places[0] @ right, posed @ right)
        end(context)
        copies = [
            _copy(context, source, source.matrix_world),
            _copy(context, target, Matrix.Translation(right * step) @ Matrix(pose.tolist()) @ target.matrix_world),
        ]
        context.view_layer.update()  # what is new can be selected from then on
        for obj in context.view_layer.objects:
            obj.select_set(obj in copies)
        context.view_layer.objects.active = copies[1]
        viewport.show_colors(context)
        if has_pictures(target) or self._preview(context, copies[1], surfaces, found):
            viewport.show_materials(context)
        viewport.look_at_selected_alone(context, np.concatenate([places[0], posed + right * step]))
        return {"FINISHED"}

    def _preview(
        self, context: bpy.types.Context, copy: bpy.types.Object, surfaces: Any, found: Correspondence
    ) -> bool:
        """Show on the copy of the target what a transfer of textures would; return whether there is any."""
        settings = preview_settings(transfer_settings(context.scene.mobius))
        if settings is None:
            return False
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            return show_preview(copy, read_through(source, target, surfaces, found, settings).carry())
        except (Refusal, MeshError) as error:
            self.report({"WARNING"}, rpt_("No preview of the textures: {}").format(error))
            return False


class MOBIUS_OT_end_side_by_side(bpy.types.Operator):
    """Remove the copies that Side by Side made and return to the whole scene."""

    bl_idname = "mobius.end_side_by_side"
    bl_label = "End Side by Side"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow where the copies are."""
        if not is_shown(context):
            cls.poll_message_set(rpt_("Nothing is shown side by side"))
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set(rpt_("Switch to Object Mode first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the copies and make the target active again."""
        viewport.look_at_all_again(context)
        end(context)
        target = context.scene.mobius.target
        if target is not None and target.name in context.view_layer.objects:
            target.select_set(True)
            context.view_layer.objects.active = target
        return {"FINISHED"}


def is_shown(context: bpy.types.Context) -> bool:
    """Return whether the scene holds a comparison."""
    return COLLECTION in context.scene.collection.children


def end(context: bpy.types.Context) -> None:
    """Remove the copies, if there are any; the meshes stay."""
    if is_shown(context):
        _remove(context.scene.collection.children[COLLECTION])


def end_for(mesh: bpy.types.Mesh) -> bool:
    """Remove the copies from every scene that shows this mesh side by side, and return whether there were any."""
    shown = [scene.collection.children.get(COLLECTION) for scene in bpy.data.scenes]
    found = {
        x
        for x in shown
        if x is not None
        and x.is_editable
        and any(obj.data == mesh or is_preview_of(obj.data, mesh.name) for obj in x.objects)
    }
    for collection in found:
        _remove(collection)
    return bool(found)


def _remove(collection: bpy.types.Collection) -> None:
    for obj in list(collection.objects):
        mesh = obj.data
        bpy.data.objects.remove(obj)
        remove_preview(mesh)
    bpy.data.collections.remove(collection)


def _beside(first: Floats, second: Floats) -> float:
    """Return how far the second has to be moved along an axis, of which both take these coordinates, to lie behind."""
    return float(first.max() - second.min() + GAP * max(np.ptp(first), np.ptp(second)))


def _world(obj: bpy.types.Object) -> Floats:
    """Return the vertices of an object in the world, (n, 3)."""
    matrix = np.array(obj.matrix_world)
    return seen_positions(obj) @ matrix[:3, :3].T + matrix[:3, 3]


def _copy(context: bpy.types.Context, obj: bpy.types.Object, matrix: Any) -> bpy.types.Object:
    """Put an object with the same mesh into the collection of the comparison."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
    if not is_shown(context):
        context.scene.collection.children.link(collection)
    copy = bpy.data.objects.new(f"{obj.name} (side by side)", obj.data)
    copy.matrix_world = matrix
    copy.show_only_shape_key, copy.active_shape_key_index = obj.show_only_shape_key, obj.active_shape_key_index
    collection.objects.link(copy)
    return copy
