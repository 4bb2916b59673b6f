"""Exchange source and target, and keep the map the other way."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...solver import MeshError
from ...solver.carry.inverse import inverted
from .. import stored_alignment
from ..mesh_data import Refusal, read_surface, settle
from ..translation import told
from ..usable import why_not_pair


class MOBIUS_OT_swap(bpy.types.Operator):
    """Make the source the target and the target the source; their map is kept the other way."""

    bl_idname = "mobius.swap"
    bl_label = "Swap Source and Target"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow where something is chosen."""
        settings = context.scene.mobius
        if settings.source is None and settings.target is None:
            cls.poll_message_set(rpt_("Choose a source or target mesh first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Exchange them. Where there is a map and none the other way yet, that is computed."""
        settle(context)
        settings = context.scene.mobius
        chosen = stored_alignment.pair(context)
        if chosen is not None and not stored_alignment.exists(*chosen):
            reason = why_not_pair(context, writes_source=True, writes_target=False) or self._keep_inverse(*chosen)
            if reason:
                self.report({"WARNING"}, rpt_("Without their map: {}").format(reason))
        settings.source, settings.target = settings.target, settings.source
        return {"FINISHED"}

    def _keep_inverse(self, source: bpy.types.Object, target: bpy.types.Object) -> str | None:
        """Keep the map the other way on the source, and return why not, None if it is."""
        try:
            surfaces = read_surface(source), read_surface(target)
            found = stored_alignment.load(target, source, surfaces)
            back = inverted(found, surfaces[0].mesh, surfaces[1].mesh)
        except (Refusal, MeshError, ValueError) as error:
            return told(str(error))
        stored_alignment.store_inverse(source, target, back, surfaces)
        return None
