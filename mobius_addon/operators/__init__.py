"""The verbs: one module per operator."""

import bpy

from . import align, check, flatten, select_unmatched, transfer

register, unregister = bpy.utils.register_classes_factory(
    (
        check.MOBIUS_OT_check,
        flatten.MOBIUS_OT_flatten,
        align.MOBIUS_OT_align,
        transfer.MOBIUS_OT_transfer,
        select_unmatched.MOBIUS_OT_select_unmatched,
    )
)
