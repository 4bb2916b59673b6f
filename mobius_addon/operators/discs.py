"""Show the two discs in a UV editor."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .. import viewport
from ..attributes import SHARED_LAYOUT
from ..usable import why_not_aligned


class MOBIUS_OT_show_discs(bpy.types.Operator):
    """Draw both discs in the shared layout in a UV editor; one is opened beside the viewport if there is none."""

    bl_idname = "mobius.show_discs"
    bl_label = "Discs in UV Editor"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in a window, for two meshes that have been aligned."""
        reason = why_not_aligned(context, writes_target=False)
        if bpy.app.background:
            reason = rpt_("Blender runs without a window")
        elif not reason and SHARED_LAYOUT not in context.scene.mobius.target.data.uv_layers:
            reason = rpt_("Closed surfaces have no discs, or the shared layout was removed")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Find or open a UV editor and look at the discs."""
        context.window_manager.mobius_view.discs = True
        area = next((area for area in context.screen.areas if area.ui_type == "UV"), None)
        if area is None:
            area = _split_off(context)
            if area is None:
                self.report({"ERROR"}, rpt_("There is no room for a UV editor: open one by hand"))
                return {"CANCELLED"}
        region = next(region for region in area.regions if region.type == "WINDOW")
        with context.temp_override(area=area, region=region):
            bpy.ops.image.view_all(fit_view=True)
        return {"FINISHED"}


def _split_off(context: bpy.types.Context) -> bpy.types.Area | None:
    """Give a third of the 3D viewport to a new UV editor and return it, or None if that is not possible."""
    whole = viewport.largest_area(context)
    if whole is None:
        return None
    before = set(context.screen.areas)
    with context.temp_override(area=whole, region=next(r for r in whole.regions if r.type == "WINDOW")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.35)
    added = set(context.screen.areas) - before
    if not added:
        return None
    area = added.pop()
    area.ui_type = "UV"
    viewport.close_later(area)
    return area
