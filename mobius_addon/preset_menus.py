"""Presets of the alignment's settings, in Blender's way: a menu in the panel's header, files in Blender's folders."""

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .options import ALIGN_OPTIONS

SUBFOLDER = "mobius/align"

_SHIPPED = str(Path(__file__).parent)


class MOBIUS_PT_align_presets(PresetPanel, bpy.types.Panel):
    """Choose, add and remove presets of the alignment's settings."""

    bl_label = "Alignment Presets"
    preset_subdir = SUBFOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "mobius.align_preset_add"


class MOBIUS_OT_align_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the alignment's settings under a name, or remove that name."""

    bl_idname = "mobius.align_preset_add"
    bl_label = "Add Alignment Preset"
    preset_menu = "MOBIUS_PT_align_presets"
    preset_subdir = SUBFOLDER
    preset_defines = ["settings = bpy.context.scene.mobius"]
    preset_values = [f"settings.{name}" for name in ALIGN_OPTIONS]


_register, _unregister = bpy.utils.register_classes_factory((MOBIUS_PT_align_presets, MOBIUS_OT_align_preset_add))


def register() -> None:
    """Register the menu, and tell Blender of the presets that come with the extension."""
    _register()
    bpy.utils.register_preset_path(_SHIPPED)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_preset_path(_SHIPPED)
    _unregister()
