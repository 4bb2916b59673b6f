"""Carry data from the source to the target, or to many targets, through their last alignments."""

# no postponed annotations here: Blender reads the properties from them
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import Correspondence
from .. import last_transfer, stored_alignment
from ..attributes import (
    Carrier,
    Reading,
    Transfer,
    TransferSettings,
    Unmatched,
    carrier_between,
    mask_weights,
    read_transfer,
    write_transfers,
)
from ..comparison import is_copy
from ..evaluated import Shown, evaluated
from ..job import Report, Work
from ..jobs import JobOperator, why_busy
from ..mesh_data import Refusal, Surface, read_surface
from ..options import TransferOptions, draw_kinds, draw_transfer, transfer_settings
from ..usable import by_uid, why_not, why_not_aligned


class MOBIUS_OT_transfer(JobOperator, TransferOptions, bpy.types.Operator):
    """Carry everything that is on the source, of the chosen kinds, to the target through their alignment."""

    bl_idname = "mobius.transfer"
    bl_label = "Transfer"
    bl_options = {"REGISTER", "UNDO"}
    job_title = "Transfer"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that have been aligned, or a source with selected others that have."""
        reason = why_not_aligned(context) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choices."""
        self.layout.use_property_split = True
        column = self.layout.column()
        column.prop(self, "carry_to")
        draw_kinds(self.layout, self, context.scene.mobius.source)
        draw_transfer(self.layout, self)

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read source and targets."""
        scene, settings = context.scene, transfer_settings(self)
        if not settings.kinds:
            raise Refusal(rpt_("Choose at least one kind of data to transfer"))
        source = scene.mobius.source
        targets = [scene.mobius.target]
        if self.carry_to == "selected":
            targets = selected_targets(context, source)
        self.objects_read = tuple(target.session_uid for target in targets)
        self._targets: list[tuple[str, Surface]] = []
        readings: list[Reading] = []
        own = read_surface(source)
        with _seen(source, own, settings) as shown:
            for target in targets:
                surfaces = own, read_surface(target)
                found = stored_alignment.load(target, source, surfaces)
                readings.append(_read(source, target, surfaces, found, settings, shown))
                self._targets.append((target.name, surfaces[1]))

        def work(report: Report) -> list[Transfer]:
            return [reading.carry(report) for reading in readings]

        self._source = source.name
        return work

    def finish(self, context: bpy.types.Context, result: Any) -> None:
        """Write on every target, if they are still what was read."""
        objects = []
        for uid, (name, surface) in zip(self.objects_read, self._targets, strict=True):
            obj = by_uid(bpy.data.objects, uid)
            if obj is None or why_not(obj, "target mesh", context.scene) is not None:
                raise Refusal(f"'{name}' was removed or is being edited since the transfer began: transfer again")
            if read_surface(obj).mesh.fingerprint != surface.mesh.fingerprint:
                raise Refusal(f"'{name}' was edited during the transfer: transfer again")
            objects.append(obj)
        pairs = list(zip(objects, result, strict=True))
        write_transfers(pairs)
        for obj, plan in pairs:
            last_transfer.announce(self.report, obj, self._source, plan)


def read_through(
    source: bpy.types.Object,
    target: bpy.types.Object,
    surfaces: tuple[Surface, Surface],
    correspondence: Correspondence,
    settings: TransferSettings,
    *,
    keeps_texture_map: bool = False,
) -> Reading:
    """Read a source and a target for a transfer through a correspondence between them.

    Raises
    ------
    Refusal
        As `mask_weights`, `evaluated` and `read_transfer`.
    """
    with _seen(source, surfaces[0], settings) as shown:
        return _read(source, target, surfaces, correspondence, settings, shown, keeps_texture_map)


def _seen(
    source: bpy.types.Object, surface: Surface, settings: TransferSettings
) -> AbstractContextManager[Shown | None]:
    """Lend the evaluated source; None if the original is to be read."""
    return evaluated(source, surface) if settings.evaluated else nullcontext()


def _read(
    source: bpy.types.Object,
    target: bpy.types.Object,
    surfaces: tuple[Surface, Surface],
    correspondence: Correspondence,
    settings: TransferSettings,
    shown: Shown | None,
    keeps_texture_map: bool = False,
) -> Reading:
    """Read a source, or what is shown of it, and a target; see `read_through`."""
    own_surface, target_surface = surfaces
    influence = mask_weights(target, settings.target_mask)

    def between(found: Correspondence, surface: Surface, whose: bpy.types.Object) -> tuple[Carrier, Unmatched]:
        gives = mask_weights(whose, settings.source_mask)
        return carrier_between(found, surface, target_surface, settings.unmatched, gives)

    if shown is None:
        carrier, unmatched = between(correspondence, own_surface, source)
        return read_transfer(
            source,
            target,
            carrier,
            settings,
            influence=influence,
            unmatched=unmatched,
            keeps_texture_map=keeps_texture_map,
        )
    carrier, unmatched = between(shown.through(correspondence, own_surface), shown.surface, shown.lent)
    # shape keys are the original's own, in its own shape
    own = between(correspondence, own_surface, source)[0]
    return read_transfer(
        source,
        target,
        carrier,
        settings,
        shown_source=shown.lent,
        keys_carrier=own,
        influence=influence,
        unmatched=unmatched,
        keeps_texture_map=keeps_texture_map,
    )


def selected_targets(context: bpy.types.Context, source: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the selected meshes other than the source; all of them have been aligned with it.

    Raises
    ------
    Refusal
        None is selected, one has not been aligned, cannot be written or shares its mesh with another.
    """
    targets = [obj for obj in context.selected_objects if obj.type == "MESH" and obj != source and not is_copy(obj)]
    if not targets:
        raise Refusal(f"Select the meshes that shall receive what is on '{source.name}'")
    for obj in targets:
        if reason := why_not(obj, "target mesh", context.scene):
            raise Refusal(reason)
        if not stored_alignment.exists(obj, source):
            raise Refusal(stored_alignment.missing(obj, source))
    for obj in targets:
        if twin := next((x for x in (source, *targets) if x != obj and x.data == obj.data), None):
            raise Refusal(f"'{obj.name}' and '{twin.name}' share one mesh: deselect one or make it single-user")
    return targets
