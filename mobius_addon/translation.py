"""The texts of the interface in other languages, for Blender's own translation functions."""

import re
from functools import lru_cache

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .german import GERMAN
from .german_sentences import GERMAN_SENTENCES

LANGUAGES = {"de_DE": GERMAN | GERMAN_SENTENCES, "de": GERMAN | GERMAN_SENTENCES}
"""By Blender's names of languages, which differ between its builds: with the country or without."""

_CONTEXTS = ("*", "Operator")
"""Where Blender looks a text up: as that of a property, label or panel, or as that of an operator's button."""


def told(sentence: str) -> str:
    """Return a sentence of the solver, which knows no Blender, in the interface's language; as it is if nobody has it.

    The solver fills in names and figures itself: the sentence is recognised by the template it was made from. What is
    filled in can be a sentence too, or several with commas or semicolons between.
    """
    for template, pattern in _patterns():
        if found := pattern.fullmatch(sentence):
            names = (sentence[:start].endswith("'") for start, _ in found.regs[1:])
            parts = zip(found.groups(), names, strict=True)
            return rpt_(template).format(*(part if is_name else told(part) for part, is_name in parts))
    for between in ("; ", ", "):
        listed = sentence.split(between)
        if len(listed) > 1:
            return between.join(map(told, listed))
    return rpt_(sentence)


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """Return the templates of sentences with what recognises them, the longest, which say most, first."""
    return tuple(
        (template, re.compile(re.escape(template).replace(r"\{\}", _hole(template)), re.DOTALL))
        for template in sorted(GERMAN_SENTENCES, key=lambda text: -len(text.replace("{}", "")))
    )


def _hole(template: str) -> str:
    """Return what recognises that which is filled in; of a noun with its number that begins with a digit."""
    return r"(\d.*?)" if template.startswith("{} ") and template.count("{") == 1 and ":" not in template else "(.+?)"


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
