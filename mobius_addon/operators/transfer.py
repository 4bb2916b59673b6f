"""Carry data from the source to the target through the last alignment."""

import bpy

from ...solver import MeshError
from .. import stored_alignment
from ..attributes import KINDS, Carrier, plan_transfer
from ..mesh_data import Refusal, read_surface
from ..options import TransferOptions, chosen_kinds
from ..usable import why_not_pair


class MOBIUS_OT_transfer(TransferOptions, bpy.types.Operator):
    """Carry everything that is on the source, of the chosen kinds, to the target through their alignment."""

    bl_idname = "mobius.transfer"
    bl_label = "Transfer"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode that have been aligned."""
        settings = context.scene.mobius
        reason = why_not_pair(settings, context.scene, writes_source=False)
        if reason is None and not stored_alignment.exists(settings.target, settings.source):
            reason = stored_alignment.missing(settings.target, settings.source)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Compute everything, then write it."""
        source, target = context.scene.mobius.source, context.scene.mobius.target
        try:
            if not self.kinds:
                raise Refusal("Choose at least one kind of data to transfer")
            surfaces = read_surface(source), read_surface(target)
            correspondence = stored_alignment.load(target, source, surfaces)
            plan = plan_transfer(source, target, Carrier(correspondence, *surfaces), chosen_kinds(self))
        except (Refusal, MeshError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        plan.write(target)
        for warning in plan.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"'{target.name}' has {describe_counts(plan.counts())} from '{source.name}'")
        return {"FINISHED"}


def describe_counts(counts: dict[str, int]) -> str:
    """Return what a transfer carried, as in '3 vertex groups, 1 UV map'."""
    nouns = {kind.identifier: kind.noun for kind in KINDS}
    return ", ".join(f"{n} {nouns[kind] if n > 1 else nouns[kind].removesuffix('s')}" for kind, n in counts.items())
