"""Correct a map by pairs of points: click on the source, click on the target, and it is bent through them at once."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy_extras import view3d_utils
from mathutils import Vector

from ...solver import MeshError
from .. import point_pairs
from ..jobs import redraw, why_busy
from ..mesh_data import Refusal, settle
from ..translation import told
from ..usable import is_read_only, why_not_aligned


class _OfPairs:
    """Mixin for operators on the pairs of an aligned source and target."""

    report: Any
    poll_message_set: Any
    follow_all: bpy.props.BoolProperty(
        name="Follow All",
        description="Bend the map through every pair, also through those that contradict it",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes that have been aligned, of which the target can be written."""
        reason = why_not_aligned(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def bend(self, context: bpy.types.Context) -> set[str]:
        """Bend the map through the pairs that there are, and say what came of it."""
        settle(context)
        settings = context.scene.mobius
        try:
            done = point_pairs.bend(settings.source, settings.target, follow_all=self.follow_all)
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, told(str(error)))
            return {"CANCELLED"}
        if is_read_only(settings.source):
            text = rpt_("'{}' is linked from another file: the shared layout and colors stay as Align left them")
            self.report({"WARNING"}, text.format(settings.source.name))
        kind, said = point_pairs.describe(*done)
        self.report({kind}, said)
        redraw(context)
        return {"FINISHED"}


class MOBIUS_OT_add_pair(_OfPairs, bpy.types.Operator):
    """Click on a point of one mesh and on where it belongs on the other: the map is bent through them at once."""

    bl_idname = "mobius.add_pair"
    bl_label = "Add Point Pair"
    bl_options = {"UNDO"}

    source_point: bpy.props.FloatVectorProperty(
        name="Source Point", description="In the source's own space", subtype="XYZ", options={"SKIP_SAVE"}
    )
    target_point: bpy.props.FloatVectorProperty(
        name="Target Point", description="In the target's own space", subtype="XYZ", options={"SKIP_SAVE"}
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the pair and bend the map; if that fails there is no new pair."""
        settle(context)
        source, target = context.scene.mobius.source, context.scene.mobius.target
        name = point_pairs.add_pair(context, source, target, (tuple(self.source_point), tuple(self.target_point)))
        done = self.bend(context)
        if "CANCELLED" in done:
            point_pairs.remove_pair(source, target, name)
        return done

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Wait for two clicks."""
        self._found: dict[str, Vector] = {}
        context.window.cursor_modal_set("CROSSHAIR")
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Take clicks on the meshes; what turns and moves the view passes through."""
        if event.type in ("ESC", "RIGHTMOUSE") and event.value == "PRESS":
            self._end(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS" or event.alt:
            return {"PASS_THROUGH"}
        view = _view_under(context, event)
        if view is None:  # a button of the panel, another editor
            return {"PASS_THROUGH"}
        hit = _hit(context, view, event)
        if hit is not None:
            self._found[hit[0]] = hit[1]
            self._tell(context)
        if len(self._found) < 2:
            return {"RUNNING_MODAL"}
        self._end(context)
        reason = why_not_aligned(context) or why_busy()
        if reason:  # it was changed meanwhile
            self.report({"ERROR"}, reason)
            return {"CANCELLED"}
        self.source_point, self.target_point = self._found["source"], self._found["target"]
        return self.execute(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator itself."""
        self._end(context)

    def _tell(self, context: bpy.types.Context) -> None:
        settings = context.scene.mobius
        wanted = [getattr(settings, role).name for role in ("source", "target") if role not in self._found]
        text = " / ".join(iface_("Click on '{}'").format(name) for name in wanted)
        context.workspace.status_text_set(f"{text}   |   {iface_('ESC: Stop')}")

    def _end(self, context: bpy.types.Context) -> None:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)


class MOBIUS_OT_bend_through_pairs(_OfPairs, bpy.types.Operator):
    """Bend the map as Align left it through the point pairs as they are now."""

    bl_idname = "mobius.bend_through_pairs"
    bl_label = "Bend Through Pairs"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bend the map."""
        return self.bend(context)


class MOBIUS_OT_remove_pair(_OfPairs, bpy.types.Operator):
    """Remove a point pair, and bend the map through those that are left."""

    bl_idname = "mobius.remove_pair"
    bl_label = "Remove Point Pair"
    bl_options = {"UNDO"}

    pair: bpy.props.StringProperty(name="Pair", description="Its name; empty: all", options={"SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the empties and bend the map."""
        source, target = context.scene.mobius.source, context.scene.mobius.target
        names = [self.pair] if self.pair else [pair.name for pair in point_pairs.listed(source, target)]
        if not [name for name in names if point_pairs.remove_pair(source, target, name)]:
            self.report({"ERROR"}, rpt_("There is no point pair '{}'").format(self.pair))
            return {"CANCELLED"}
        context.view_layer.update()
        return self.bend(context)


class MOBIUS_OT_select_pair(bpy.types.Operator):
    """Select the two empties of a point pair, to be moved."""

    bl_idname = "mobius.select_pair"
    bl_label = "Select Point Pair"
    bl_options = {"UNDO", "INTERNAL"}  # which F3, that knows no name to give it, leaves out

    pair: bpy.props.StringProperty(name="Pair", description="Its name", options={"SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select them, the target's active."""
        settings = context.scene.mobius
        pairs = point_pairs.listed(settings.source, settings.target) if settings.source and settings.target else []
        found = next((pair for pair in pairs if pair.name == self.pair), None)
        shown = context.view_layer.objects
        if found is None or context.mode != "OBJECT" or found.source not in shown or found.target not in shown:
            self.report({"ERROR"}, rpt_("There is no point pair '{}'").format(self.pair))
            return {"CANCELLED"}
        for obj in shown:
            obj.select_set(obj.name in (found.source, found.target))
        shown.active = shown[found.target]
        return {"FINISHED"}


def _view_under(context: bpy.types.Context, event: bpy.types.Event) -> Any:
    """Return space, region and view of the 3D viewport under the mouse, None if it is over anything else."""
    for area in context.window.screen.areas:
        if area.type != "VIEW_3D":
            continue
        inside = [x for x in area.regions if _is_inside(x, event)]
        if not inside or any(x.type != "WINDOW" for x in inside):  # the sidebar lies over the viewport
            continue
        space = area.spaces.active
        windows = [x for x in area.regions if x.type == "WINDOW"]
        views = space.region_quadviews
        return space, inside[0], views[windows.index(inside[0])] if len(views) else space.region_3d
    return None


def _is_inside(region: bpy.types.Region, event: bpy.types.Event) -> bool:
    x, y = event.mouse_x - region.x, event.mouse_y - region.y
    return region.width > 1 and 0 <= x < region.width and 0 <= y < region.height


def _hit(context: bpy.types.Context, view: Any, event: bpy.types.Event) -> tuple[str, Vector] | None:
    """Return which mesh the mouse is on, "source" or "target", and where, in its own space; None: neither.

    Copies that show them side by side have their mesh and its space, and count as they.
    """
    space, region, data = view
    at = Vector((event.mouse_x - region.x, event.mouse_y - region.y))
    origin = view3d_utils.region_2d_to_origin_3d(region, data, at)
    direction = view3d_utils.region_2d_to_vector_3d(region, data, at)
    settings, best, least = context.scene.mobius, None, float("inf")
    depsgraph = context.evaluated_depsgraph_get()
    for obj in context.view_layer.objects:
        role = next((x for x in ("source", "target") if obj.data and obj.data == getattr(settings, x).data), None)
        if role is None or not obj.visible_get(viewport=space):
            continue
        shown = obj.evaluated_get(depsgraph)
        inverse = shown.matrix_world.inverted_safe()
        start, way = inverse @ origin, inverse.to_3x3() @ direction
        found, place, *_ = shown.ray_cast(start, way)
        distance = (shown.matrix_world @ place - origin).length if found else least
        if distance < least:
            best, least = (role, place.copy()), distance
    return best
