"""Presets in Blender's way: menus in the headers of the settings' panels, files in Blender's own folders."""

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .options import ALIGN_OPTIONS, OF_SCENE, TRANSFER_OPTIONS
from .registration import register_factory

_SHIPPED = str(Path(__file__).parent)


class MOBIUS_PT_align_presets(PresetPanel, bpy.types.Panel):
    """Choose, add and remove presets of the alignment's settings."""

    bl_label = "Alignment Presets"
    preset_subdir = "mobius/align"
    preset_operator = "script.execute_preset"
    preset_add_operator = "mobius.align_preset_add"


class MOBIUS_OT_align_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the alignment's settings under a name, or remove that name."""

    bl_idname = "mobius.align_preset_add"
    bl_label = "Add Alignment Preset"
    preset_menu = "MOBIUS_PT_align_presets"
    preset_subdir = MOBIUS_PT_align_presets.preset_subdir
    preset_defines = ["settings = bpy.context.scene.mobius"]
    preset_values = [f"settings.{name}" for name in ALIGN_OPTIONS if name not in OF_SCENE]


class MOBIUS_PT_transfer_presets(PresetPanel, bpy.types.Panel):
    """Choose, add and remove presets of the transfer's settings."""

    bl_label = "Transfer Presets"
    preset_subdir = "mobius/transfer"
    preset_operator = "script.execute_preset"
    preset_add_operator = "mobius.transfer_preset_add"


class MOBIUS_OT_transfer_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the transfer's settings, the kinds of data included, under a name, or remove that name."""

    bl_idname = "mobius.transfer_preset_add"
    bl_label = "Add Transfer Preset"
    preset_menu = "MOBIUS_PT_transfer_presets"
    preset_subdir = MOBIUS_PT_transfer_presets.preset_subdir
    preset_defines = ["settings = bpy.context.scene.mobius"]
    preset_values = [f"settings.{name}" for name in TRANSFER_OPTIONS]


_register, _unregister = register_factory(
    (
        MOBIUS_PT_align_presets,
        MOBIUS_OT_align_preset_add,
        MOBIUS_PT_transfer_presets,
        MOBIUS_OT_transfer_preset_add,
    )
)


def register() -> None:
    """Register the menus, and tell Blender of the presets that come with the extension."""
    _register()
    bpy.utils.register_preset_path(_SHIPPED)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_preset_path(_SHIPPED)
    _unregister()
