"""Sentences in other languages: what the solver and the add-on say is recognised by the templates it is made from."""

import ast
import os
import string
import struct
from pathlib import Path

import pytest
import texts
from scenes import make_object

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import topology_cache, translation  # noqa: E402
from mobius_extension.mobius_addon.computation import Repair  # noqa: E402
from mobius_extension.mobius_addon.german import GERMAN  # noqa: E402
from mobius_extension.mobius_addon.german_sentences import GERMAN_SENTENCES  # noqa: E402


@pytest.fixture(autouse=True)
def _in_german(monkeypatch: pytest.MonkeyPatch) -> None:
    """The Python module is built without languages."""
    known = GERMAN | GERMAN_SENTENCES
    monkeypatch.setattr(translation, "rpt_", lambda text: known.get(text, text))


def holes(text: str) -> int:
    return sum(name is not None for _, name, _, _ in string.Formatter().parse(text))


def test_whatever_is_refused_or_reported_is_translated() -> None:
    sentences = texts.of_sentences()
    assert len(sentences) > 50
    assert sorted(sentences - set(GERMAN_SENTENCES)) == []


def filled_in(text: str) -> list[tuple[str | None, str | None]]:
    return [(name, form) for _, name, form, _ in string.Formatter().parse(text) if name is not None]


@pytest.mark.parametrize("language", translation.LANGUAGES)
def test_every_language_has_every_text(language: str) -> None:
    own = translation.LANGUAGES[language]
    assert sorted((GERMAN | GERMAN_SENTENCES).keys() - own.keys()) == []
    for english, text in own.items():
        assert filled_in(english) == filled_in(text), english
        assert english.endswith(":") == text.endswith(":"), english


def test_every_stage_of_the_work_is_translated() -> None:
    found = set()
    for path in sorted((texts.ROOT / "solver").glob("**/*.py")):
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(call, ast.Call) and getattr(call.func, "attr", "") == "begin" and len(call.args) == 3:
                branches = (
                    [call.args[1].body, call.args[1].orelse] if isinstance(call.args[1], ast.IfExp) else [call.args[1]]
                )
                found |= {x.value for x in branches if isinstance(x, ast.Constant) and isinstance(x.value, str)}
    assert len(found) > 8
    of_collections = {"Flattening"}  # which have no window
    assert sorted(found - set(GERMAN) - of_collections) == []


@pytest.mark.parametrize("template", GERMAN_SENTENCES)
def test_a_sentence_is_recognised_by_its_template(template: str) -> None:
    german = GERMAN_SENTENCES[template]
    assert holes(template) == holes(german)
    given = [f"{number}X" for number in range(holes(template))]
    assert translation.told(template.format(*given)) == german.format(*given)


def test_what_is_filled_in_is_translated_too_but_no_name() -> None:
    few = "'3 vertices' has 3 vertices inside its boundary, and 4 are the fewest that tell how it lies: subdivide it"
    assert translation.told(few).startswith("„3 vertices“ hat 3 Punkte innerhalb des Rands, und 4 sind das Wenigste")
    done = "'source': 12 faces turned over, 2 openings (8, 9 edges) closed, for the computation only"
    assert translation.told(done) == (
        "„source“: 12 Flächen umgedreht, 2 Öffnungen (8, 9 Kanten) geschlossen, nur für die Berechnung"
    )
    assert translation.told("nobody has translated this, nor that") == "nobody has translated this, nor that"


def test_what_a_transfer_says_is_translated() -> None:
    nothing = "'A, B' has no active vertex groups or UV maps to transfer ('Chin' is locked on 'B' and left as it is)"
    assert translation.told(nothing) == (
        "„A, B“ hat keine aktiven Punktgruppen oder UV-Maps zum Übertragen "
        "(„Chin“ ist auf „B“ gesperrt und bleibt, wie es ist)"
    )
    kept = "'Target' keeps its own attributes ('Heat', 'Side'): carried as 'Heat.001', 'Side.001'"
    assert "behält Eigenes, Eigenschaften ('Heat', 'Side'): übertragen als 'Heat.001'" in translation.told(kept)
    left = "2,000 vertices of 'B' (3.0% of its area) have no certain counterpart and are left as they were"
    assert translation.told(left).startswith("2,000 Punkte von „B“ (3.0% der Fläche) haben kein sicheres Gegenstück")
    assert translation.told("1 vertex group, 12 UV maps") == "1 Punktgruppe, 12 UV-Maps"
    assert translation.told("Vertex Groups of 'B'") == "Punktgruppen von „B“"


def test_what_is_wrong_with_a_mesh_is_translated_without_its_name() -> None:
    empty = make_object("Points", [(0, 0, 0), (1, 0, 0)], [])
    assert topology_cache.line_of(empty, Repair()).rows == ("hat keine Flächen",)


def blenders_own() -> dict[str, set[str]]:
    """Blender's German, from the compiled catalogue of a Blender on this machine: by English text, in any context."""
    path = Path(os.environ.get("BLENDER_ROOTS", "/opt")) / "sid/usr/share/locale/de/LC_MESSAGES/blender.mo"
    if not path.exists():
        pytest.skip(f"'{path}' is not there: no Blender with languages")
    data = path.read_bytes()
    count, *starts = struct.unpack("<3I", data[8:20])
    found: dict[str, set[str]] = {}
    for k in range(count):
        places = (struct.unpack("<2I", data[start + 8 * k : start + 8 * k + 8]) for start in starts)
        english, german = (data[place : place + length].decode() for length, place in places)
        found.setdefault(english.rpartition("\x04")[2], set()).add(german)
    return found


def test_what_blender_has_a_word_for_is_called_so() -> None:
    # Blender looks its own up first, so that two words for one thing would stand beside each other
    own = blenders_own()
    different = {text: (german, own[text]) for text, german in GERMAN.items() if german not in own.get(text, {german})}
    assert different.keys() <= OTHERWISE


OTHERWISE = {"Bending", "Fit", "To", "Samples", "Longest", "Selected", "Active"}
"""Of which Blender's word is for something else, or of another gender."""
