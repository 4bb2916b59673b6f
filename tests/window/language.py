"""Runs in Blender's window, driven by `gui_shot.sh`: a made-up language, as a translator adds one.

Each text is set between quotes, a third longer, with letters of four scripts. What is seen without them was not
translated, or has Blender's own word. `bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib

import hand
from hand import Wait, picture

vars(hand).update(region=region, click=click, shot=shot)
addon = PACKAGE + ".mobius_addon."
translation, panel = (importlib.import_module(addon + name) for name in ("translation", "panel"))
german, sentences = (importlib.import_module(addon + name) for name in ("german", "german_sentences"))

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}
SMALL = 0.75
"""Of the interface's scale, at which all panels are in the window when unfolded."""


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    english = german.GERMAN.keys() | sentences.GERMAN_SENTENCES.keys()
    made_up = {text: made(text) for text in english}
    translation.unregister()
    translation.LANGUAGES.update(fr_FR=made_up, fr=made_up)  # what the third step of docs/translating.md says
    translation.register()
    preferences = bpy.context.preferences
    languages = preferences.view.bl_rna.properties["language"].enum_items.keys()
    preferences.view.language = "fr" if "fr" in languages else "fr_FR"
    yield from picture("language-empty")
    assert bpy.ops.mobius.load_example("EXEC_DEFAULT", True) == {"FINISHED"}
    assert bpy.ops.mobius.align("EXEC_DEFAULT", True, **QUICK) == {"FINISHED"}
    assert bpy.ops.mobius.transfer("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.context.window_manager.mobius_view.matches = True
    yield from picture("language", 3.0)
    panel.unregister()
    for part in bpy.types.Panel.__subclasses__():
        if part.__module__.startswith(addon):
            part.bl_options = set(getattr(part, "bl_options", ())) - {"DEFAULT_CLOSED"}
    panel.register()
    preferences.view.ui_scale = SMALL
    bpy.utils.unregister_class(panel.MOBIUS_PT_transfer)
    yield from picture("language-unfolded", 6.0)
    preferences.view.ui_scale = 1.0
    bpy.ops.screen.userpref_show("INVOKE_DEFAULT", section="ADDONS")
    yield 1.0
    bpy.context.window_manager.addon_search = "bius"
    bpy.ops.preferences.addon_expand("EXEC_DEFAULT", module=PACKAGE)
    yield from picture("language-preferences", 3.0)
    print("[clicks] done", flush=True)


def made(text: str) -> str:
    """Return a text of the made-up language."""
    rest = "é" * (len(text) // 3)
    colon = ":" if text.endswith(":") else ""
    return f"‹Жλ語 {text.removesuffix(':')} {rest}›{colon}"
