"""Every English text of the interface: from the registered classes, and from the calls that draw and report."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
TRANSLATED = {"iface_", "rpt_", "n_"}


def of_classes() -> set[str]:
    """Labels and tooltips of our operators, panels and properties, as Blender knows them."""
    import bpy

    found: set[str] = set()
    owners: list[Any] = [
        getattr(bpy.ops.mobius, name).get_rna_type() for name in dir(bpy.ops.mobius) if not name.endswith("preset_add")
    ]
    for rna in owners:
        found |= {rna.name, rna.description}
    for owner, name in ((bpy.types.Scene, "mobius"), (bpy.types.WindowManager, "mobius_view")):
        owners.append(owner.bl_rna.properties[name].fixed_type)
    owners.append(bpy.types.Scene.bl_rna.properties["mobius"].fixed_type.properties["proof"].fixed_type)
    if addon := next((x for x in bpy.types.AddonPreferences.__subclasses__() if x.__name__.startswith("MOBIUS")), None):
        owners.append(addon.bl_rna)
    for rna in owners:
        for prop in rna.properties:
            if prop.identifier not in ("rna_type", "name", "bl_idname"):
                found |= {prop.name, prop.description}
                found |= {text for item in getattr(prop, "enum_items", ()) for text in (item.name, item.description)}
    found |= {getattr(bpy.types, name).bl_label for name in dir(bpy.types) if name.startswith("MOBIUS_PT_")}
    return found - {""}


def of_code() -> set[str]:
    """Texts in calls that translate, and in `text=` and `heading=` of layouts."""
    found: set[str] = set()
    for path in sorted((ROOT / "mobius_addon").glob("**/*.py")):
        if "demo" not in path.parts and path.name != "german.py":
            for call in _calls(path):
                name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
                if name in TRANSLATED:
                    found |= set(constants(call.args[0]))
                elif name in ("label", "prop", "operator", "column") and "layout" not in path.stem:
                    for keyword in call.keywords:
                        if keyword.arg in ("text", "heading"):
                            found |= set(constants(keyword.value))
    return {text for text in found if text.strip()}


def _calls(path: Path) -> Iterator[ast.Call]:
    return (x for x in ast.walk(_tree(path)) if isinstance(x, ast.Call))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def constants(node: ast.AST) -> Iterator[str]:
    """Texts that an argument can be: itself, or either branch of a condition."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from constants(node.body)
        yield from constants(node.orelse)
    elif isinstance(node, ast.BoolOp):
        for value in node.values:
            yield from constants(value)


OF_FILES = {"demo", "studio", "command_line", "files", "collection"}
"""Folders whose sentences are for those who read English, as those about damaged data are."""

SAYING = {"attributes", "textures"}
"""Folders of the add-on in which every sentence is read by an artist, as a refusal or as a warning."""


def of_sentences() -> set[str]:
    """Templates of what the solver refuses and what the add-on refuses or reports without Blender's own translation.

    What is filled in is {}.
    """
    found: set[str] = set()
    errors = artists_errors()
    for folder in ("solver", "mobius_addon"):
        for path in sorted((ROOT / folder).glob("**/*.py")):
            if set(path.parts) & OF_FILES or path.name.startswith("german"):
                continue
            for call in _calls(path):
                name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
                said = call.args[:1] if name in errors else call.args[1:2] if name in ("report", "_report") else []
                found |= {text for argument in said for text in _templates(argument)}
            if path.parent.name in SAYING:
                found |= _said(_tree(path))
    return {text for text in found if text.count(" ") > 2}


def artists_errors() -> set[str]:
    """Names of the exceptions that operators report to an artist: the two that they catch and all of these."""
    parents: dict[str, set[str]] = {}
    for folder in ("solver", "mobius_addon"):
        for path in (ROOT / folder).glob("**/*.py"):
            for node in ast.walk(_tree(path)):
                if isinstance(node, ast.ClassDef):
                    parents[node.name] = {x.id for x in node.bases if isinstance(x, ast.Name)}
    found, more = set(), {"Refusal", "MeshError"}
    while more:
        found |= more
        more = {name for name, own in parents.items() if own & found} - found
    # whose text goes on after a layout's name, in a Refusal
    return found | {"LayoutError"}


def _said(tree: ast.Module) -> set[str]:
    """Every sentence of a module but docstrings, and what is for programmers or in the catalogue of the interface."""
    aside: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            aside.add(id(node.value))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in {"ValueError", "AssertionError", "Kind", *TRANSLATED}:
                aside |= {id(inner) for argument in node.args for inner in ast.walk(argument)}
        elif isinstance(node, ast.JoinedStr):  # as a whole
            aside |= {id(inner) for part in node.values for inner in (part, getattr(part, "format_spec", None))}
    texts = (x for x in ast.walk(tree) if isinstance(x, ast.Constant | ast.JoinedStr) and id(x) not in aside)
    # attributes have names that no language changes
    return {text for node in texts for text in _templates(node) if not text.startswith("Mobius ")}


def _templates(node: ast.AST) -> Iterator[str]:
    """Texts that an expression can be, with {} for what is filled in; nothing of what calls another function."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    elif isinstance(node, ast.IfExp):
        yield from _templates(node.body)
        yield from _templates(node.orelse)
