"""Align the source with every other selected mesh, as one job and one undo step."""

# no postponed annotations here: Blender reads the properties from them
from dataclasses import dataclass, replace
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ... import solver
from ...solver.surface.tidy import Piece
from .. import landmarks, results, stored_alignment
from ..attributes import SHARED_COLOR, SHARED_LAYOUT, piece_of, restored_on_failure
from ..comparison import is_copy
from ..computation import aligned
from ..job import Report, Work
from ..jobs import JobOperator, why_busy
from ..mesh_data import Refusal, Surface, read_surface, unseen_warning
from ..options import AlignOptions, ScanOptions, align_settings, outer_vertex
from ..preferences import preferences
from ..translation import told
from ..usable import why_not, why_not_mode, why_not_two, written
from ..verdict import counted, judgement_of, verdict_sentence
from .align import Aligned, as_read, only_read, write_alignment


@dataclass(frozen=True, eq=False)
class _Target:
    """One of the targets, as it was read."""

    uid: int
    name: str
    surface: Surface
    settings: solver.AlignSettings
    pairs: Any
    within: Piece | None


def selected_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected meshes but the source, in alphabetical order."""
    source = context.scene.mobius.source
    chosen = [obj for obj in context.selected_objects if obj.type == "MESH" and obj != source and not is_copy(obj)]
    return sorted(chosen, key=lambda obj: obj.name)


class MOBIUS_OT_align_selected(JobOperator, AlignOptions, ScanOptions, bpy.types.Operator):
    """Match the source with every other selected mesh, one after the other; they share the source's UV map."""

    bl_idname = "mobius.align_selected"
    bl_label = "Align Selected"
    bl_options = {"UNDO"}
    job_title = "Align Selected"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for a source and selected meshes in Object Mode, of which those can be written."""
        source, targets = context.scene.mobius.source, selected_targets(context)
        reason = why_not(source, "source mesh", context.scene, writes=False)
        if reason is None and not targets:
            reason = rpt_("Select the meshes that '{}' is to be aligned with").format(source.name)
        for target in targets:
            reason = reason or why_not(target, "target mesh", context.scene) or why_not_two(source, target)
        reason = reason or why_not_mode(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read all meshes."""
        source, objects = context.scene.mobius.source, selected_targets(context)
        self._source = source.session_uid, source.name
        self._surface = surface = read_surface(source)
        self.objects_read = (source.session_uid, *(obj.session_uid for obj in objects))
        kept = preferences(context)
        limit = kept.time_limit if kept else solver.AlignSettings().time_limit or 0.0
        targets: list[_Target] = []
        for obj in {obj for own in objects for obj in written(source, own)}:
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        for obj in objects:
            own = read_surface(obj)
            outer = outer_vertex(source, surface, self), outer_vertex(obj, own, self)
            pairs = landmarks.from_scene(source, obj, (surface.mesh, own.mesh), self.landmarks)
            settings, piece = align_settings(self, limit, outer), piece_of(obj, self.target_cut)
            targets.append(_Target(obj.session_uid, obj.name, own, settings, pairs, piece))
        self._targets = targets
        largest_part, within = self.largest_part, piece_of(source, self.source_cut)

        def work(report: Report) -> list[Aligned | str]:
            done: list[Aligned | str] = []
            for number, target in enumerate(targets):

                def tell(now: solver.Progress, number: int = number, target: _Target = target) -> bool | None:
                    stage = f"{number + 1}/{len(targets)} '{target.name}'"
                    return report(replace(now, stage=stage, fraction=(number + now.fraction) / len(targets)))

                asked = {"largest_part": largest_part, "landmarks": target.pairs, "progress": tell}
                asked |= {"keys": (surface.keys, target.surface.keys), "within": (within, target.within)}
                try:
                    found = aligned(surface.mesh, target.surface.mesh, target.settings, **asked)
                    done.append(Aligned(*found))
                except solver.MeshError as error:
                    done.append(str(error))
            return done

        return work

    def finish(self, context: bpy.types.Context, result: list[Aligned | str]) -> None:
        """Write on the source and each target that is still what was read; name the others."""
        source = as_read(*self._source, self._surface)
        levels: list[str] = []
        for target, done in zip(self._targets, result, strict=True):
            if isinstance(done, str):
                self.report({"WARNING"}, f"{target.name}: {told(done)}")
                continue
            try:
                obj = as_read(target.uid, target.name, target.surface)
                results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
            except Refusal as refusal:
                self.report({"WARNING"}, told(str(refusal)))
                continue
            surfaces = self._surface, target.surface
            with restored_on_failure(*written(source, obj)):
                # in the source's own disc, which is the same for all of them
                write_alignment(
                    source, obj, done.alignment, done.correspondence, surfaces, frame=type(done.alignment.mobius)()
                )
                stored_alignment.store(obj, source, done.alignment, done.correspondence, surfaces)
            for warning in filter(None, (unseen_warning(obj), *done.alignment.warnings)):
                self.report({"WARNING"}, f"{target.name}: {told(warning)}")
            if (found := stored_alignment.figures(obj)) is not None:
                levels.append(judgement_of(found).level)
                self.report({"INFO"}, verdict_sentence(context.scene, source, obj, found))
        if sentence := only_read(source):
            self.report({"INFO"}, sentence)
        if not levels:
            raise Refusal(rpt_("None of the selected meshes could be aligned with '{}'").format(source.name))
        if len(self._targets) > 1:  # the last report is what the status bar shows
            text = rpt_("'{}' is aligned with {} of {} meshes: {}")
            self.report({"INFO"}, text.format(source.name, len(levels), len(self._targets), counted(levels)))
