"""Align and transfer in one go, for two selected meshes."""

# no postponed annotations here: Blender reads the properties from them
from contextlib import suppress

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import Correspondence
from .. import last_transfer, results, stored_alignment
from ..attributes import SHARED_COLOR, SHARED_LAYOUT, restored_on_failure
from ..job import Report, Work
from ..jobs import why_busy
from ..mesh_data import Refusal, read_surface
from ..options import (
    ALIGN_OPTIONS,
    SCAN_OPTIONS,
    TRANSFER_OPTIONS,
    TransferOptions,
    draw_kinds,
    draw_transfer,
    transfer_settings,
)
from ..usable import by_uid, why_not, why_not_mode, why_not_two, written
from .align import Aligned, AlignOperator
from .transfer import read_through


class MOBIUS_OT_conformal_transfer(AlignOperator, TransferOptions, bpy.types.Operator):
    """Carry what is on the active mesh to the other selected one, of another shape, pose or triangulation."""

    bl_idname = "mobius.conformal_transfer"
    bl_label = "Transfer by Conformal Map (Mobius)"
    bl_options = {"REGISTER", "UNDO"}
    job_title = "Transfer by Conformal Map"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two selected meshes, of which the active one is the source."""
        reason = _why_not(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Take what was chosen in the panel, where the caller says nothing else."""
        for name in (*ALIGN_OPTIONS, *SCAN_OPTIONS, *TRANSFER_OPTIONS):
            if not self.properties.is_property_set(name):  # what Blender remembers of the last time counts as not set
                setattr(self, name, getattr(context.scene.mobius, name))
        return self.execute(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what can be changed without a new search."""
        self.layout.use_property_split = True
        draw_kinds(self.layout, self, context.scene.mobius.source)
        draw_transfer(self.layout, self)

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read both meshes; what is known of this pair is not searched for again."""
        if not self.kinds:
            raise Refusal(rpt_("Choose at least one kind of data to transfer"))
        source, target = _pair(context)
        for obj in written(source, target):
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        work = self.begin(context, source, target)
        self._known = None
        if stored_alignment.exists(target, source):
            surfaces = read_surface(source), read_surface(target)
            with suppress(Refusal):  # it was edited since
                self._known = stored_alignment.load(target, source, surfaces)
        known = self._known

        def align_if_needed(report: Report) -> Aligned | Correspondence:
            return work(report) if known is None else known

        return align_if_needed

    def finish(self, context: bpy.types.Context, result: Aligned | Correspondence) -> None:
        """Carry the data through the correspondence, then write both; if either fails, nothing is written."""
        if isinstance(result, Aligned):
            self.remember(result)
        source, target = self.objects()
        found = result.correspondence if isinstance(result, Aligned) else result
        settings = transfer_settings(self)
        plan = read_through(source, target, self.surfaces, found, settings).carry()
        with restored_on_failure(*written(source, target)):
            if isinstance(result, Aligned):
                self.keep(source, target, result)
            plan.write(target)
        if isinstance(result, Aligned):
            self.announce(source, target, result)
        last_transfer.announce(self.report, target, source.name, plan)
        if (scene := by_uid(bpy.data.scenes, self._scene)) is not None:
            scene.mobius.source, scene.mobius.target = source, target


def _pair(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Return the active object and the other selected one: from active to selected, as Blender's own transfers go."""
    source = context.object
    return source, next(obj for obj in context.selected_objects if obj != source)


def _why_not(context: bpy.types.Context) -> str | None:
    """Return why the selection cannot be used, or None if it can."""
    chosen, source = context.selected_objects, context.object
    if source is None or source not in chosen or len(chosen) != 2:
        return rpt_("Select two meshes, the source last: it is the active one")
    source, target = _pair(context)
    scene = context.scene
    reason = why_not(source, "source mesh", scene, writes=False) or why_not(target, "target mesh", scene)
    return reason or why_not_two(source, target) or why_not_mode(context)
