"""Going to Edit Mode of one object, where it can be seen."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..usable import why_not_alone
from .which import in_viewport, space_of


def edit(context: bpy.types.Context, obj: bpy.types.Object, *, look: bool = True) -> str | None:
    """Go to Edit Mode of an object alone and, where there is a window, look at what is selected of it if asked to.

    Returns
    -------
    str or None
        Why that is not possible, and nothing was done; None if it was.
    """
    if reason := why_not_alone(context, obj):
        return reason
    layer, space = context.view_layer, space_of(context)
    layer.update()
    if layer.objects.get(obj.name) != obj:
        text = rpt_("'{}' is in no collection of this view layer: include its collection in the Outliner to see them")
        return text.format(obj.name)
    hidden = obj.hide_get()
    obj.hide_set(False)
    if not obj.visible_get():
        obj.hide_set(hidden)
        text = rpt_("'{}' is disabled in viewports, or its collection is hidden: show it in the Outliner to see them")
        return text.format(obj.name)
    if space is not None and space.local_view:
        obj.local_view_set(space, True)
    for other in layer.objects:  # what is selected would go to Edit Mode too
        other.select_set(other == obj)
    layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    if look:
        look_at_selected(context)
    return None


def look_at_selected(context: bpy.types.Context) -> None:
    """Have the viewport, where there is one, look at what is selected."""
    if space_of(context) is not None:
        with in_viewport(context):
            bpy.ops.view3d.view_selected()
