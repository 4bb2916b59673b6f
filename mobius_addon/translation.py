"""The texts of the interface in other languages, for Blender's own translation functions."""

import bpy

from .german import GERMAN

LANGUAGES = {"de_DE": GERMAN, "de": GERMAN}
"""By Blender's names of languages: 'de_DE' up to 4.4, 'de' from 4.5 on."""

_CONTEXTS = ("*", "Operator")
"""Where Blender looks a text up: as that of a property, label or panel, or as that of an operator's button."""


def register() -> None:
    """Tell Blender the translations."""
    texts = {
        language: {(context, english): own for english, own in known.items() for context in _CONTEXTS}
        for language, known in LANGUAGES.items()
    }
    bpy.app.translations.register(__package__, texts)


def unregister() -> None:
    """Undo `register`."""
    bpy.app.translations.unregister(__package__)
