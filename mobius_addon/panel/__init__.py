"""The panel "Möbius" in the sidebar of the 3D viewport, one module per part, and the entry in the Object menu."""

import bpy

from ..operators.conformal_transfer import MOBIUS_OT_conformal_transfer
from .fitted import MOBIUS_PT_fitted
from .last_transfer import MOBIUS_PT_last_transfer
from .live import MOBIUS_PT_live
from .main import MOBIUS_PT_main
from .mending import MOBIUS_MT_mend
from .pairs import MOBIUS_PT_pairs
from .parts import MOBIUS_PT_parts
from .proof import MOBIUS_PT_notes, MOBIUS_PT_proof
from .result import MOBIUS_PT_result
from .settings import MOBIUS_PT_alignment, MOBIUS_PT_scans
from .show import MOBIUS_PT_pictures
from .targets import MOBIUS_PT_targets
from .transfer import MOBIUS_PT_transfer, MOBIUS_PT_transfer_settings


def _draw_in_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry in Object > Link/Transfer Data."""
    menu.layout.separator()
    menu.layout.operator(MOBIUS_OT_conformal_transfer.bl_idname, icon="MOD_DATA_TRANSFER")


_register, _unregister = bpy.utils.register_classes_factory(
    (
        MOBIUS_MT_mend,
        MOBIUS_PT_main,
        MOBIUS_PT_targets,
        MOBIUS_PT_result,
        MOBIUS_PT_proof,
        MOBIUS_PT_notes,
        MOBIUS_PT_pairs,
        MOBIUS_PT_parts,
        MOBIUS_PT_pictures,
        MOBIUS_PT_transfer,
        MOBIUS_PT_last_transfer,
        MOBIUS_PT_transfer_settings,
        MOBIUS_PT_live,
        MOBIUS_PT_fitted,
        MOBIUS_PT_scans,
        MOBIUS_PT_alignment,
    )
)


def register() -> None:
    """Register the panels and the menu's entry."""
    _register()
    bpy.types.VIEW3D_MT_make_links.append(_draw_in_menu)


def unregister() -> None:
    """Undo `register`."""
    bpy.types.VIEW3D_MT_make_links.remove(_draw_in_menu)
    _unregister()
