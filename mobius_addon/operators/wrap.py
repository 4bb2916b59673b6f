"""Make a new object that has one mesh's triangles and the other's shape."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver.carry.fitted import Fitted, in_shape_of, wrapped
from .. import stored_alignment
from ..comparison import is_shown
from ..fitting import reshaped_object, wrapped_object
from ..job import Report, Work
from ..jobs import JobOperator, why_busy
from ..mesh_data import Refusal, read_surface
from ..usable import by_uid, is_deleted, why_not_aligned, why_not_mode
from . import side_by_side


class MOBIUS_OT_wrap(JobOperator, bpy.types.Operator):
    """Make a new object in the fitted shape; source and target stay as they are."""

    bl_idname = "mobius.wrap"
    bl_label = "Fitted Shape"  # of either way: the redo panel bears it
    bl_options = {"REGISTER", "UNDO"}
    job_title = "Fitted Shape"

    fitted: bpy.props.EnumProperty(
        name="New Object",
        description="Which of the two is bent into the shape of the other",
        items=(
            ("source", "Source onto Target", "The source's mesh with its UV maps, groups, materials and shape keys, "
             "wrapped onto the target"),
            ("target", "Target as Source", "A copy of the target, with the source's shape as a shape key"),
        ),
        default="source",
    )  # fmt: skip

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes that have been aligned."""
        reason = why_not_aligned(context, writes_target=False) or why_not_mode(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read both meshes and their alignment."""
        settings = context.scene.mobius
        source, target = settings.source, settings.target
        self.objects_read = source.session_uid, target.session_uid
        self._surfaces = surfaces = read_surface(source), read_surface(target)
        self._names = source.name, target.name
        found = stored_alignment.load(target, source, surfaces)
        fit = wrapped if self.fitted == "source" else in_shape_of

        def work(_report: Report) -> Fitted:
            try:
                return fit(found, surfaces[0].mesh, surfaces[1].mesh)
            except ValueError as error:
                raise Refusal(rpt_("Too little of the two meshes is matched: align them again")) from error

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> None:
        """Make the object, if source and target are still what was read."""
        objects = [by_uid(bpy.data.objects, uid) for uid in self.objects_read]
        for obj, name, surface in zip(objects, self._names, self._surfaces, strict=True):
            if obj is None or is_deleted(obj) or read_surface(obj).mesh.fingerprint != surface.mesh.fingerprint:
                raise Refusal(rpt_("'{}' was removed or edited meanwhile: call it again").format(name))
        source, target = objects
        if is_shown(context):  # what is new would not be seen
            side_by_side.leave(context)
        onto = self.fitted == "source"
        make, surface = (wrapped_object, self._surfaces[0]) if onto else (reshaped_object, self._surfaces[1])
        made = make(source, target, surface, result)
        for obj in context.selected_objects:
            obj.select_set(False)
        context.view_layer.update()
        if made.name in context.view_layer.objects:
            made.select_set(True)
            context.view_layer.objects.active = made
        for sentence in remarks(made.name, result):
            self.report({"WARNING"}, sentence)
        text = rpt_("'{}' is new: {:.0%} of its vertices lie where the map says, the others are filled smoothly")
        self.report({"INFO"}, text.format(made.name, result.matched.mean()))


def remarks(name: str, fitted: Fitted) -> list[str]:
    """Return sentences about what is wrong with a fitted shape."""
    if not fitted.folded:
        return []
    return [rpt_("'{}' has folded triangles: {:,}. Smooth them in Sculpt Mode").format(name, fitted.folded)]
