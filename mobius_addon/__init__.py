"""The Blender side: properties, operators, panel, mesh and attribute access, files and the command line.

No module here holds mathematics: each reads arrays from Blender, calls `solver` and writes arrays back.
"""

import sys
from importlib import import_module

# in the order in which they register; each has `register` and `unregister`
_TOOLS = (
    "edits",
    "fingerprints",
    "topology_cache",
    "kept_surfaces",
    "overlay",
    "preferences",
    "properties",
    "earlier_version",
    "deleted",
    "jobs",
    "playing",
    "operators",
    "shown_result",
    "saving",
    "preset_menus",
    "panel",
    "translation",
    "command_line",
)
_INSTEAD = ("absent",)
_registered: list[str] = []


def register() -> None:
    """Register every class, property and command; nothing stays registered if one of them fails.

    Where scipy cannot be loaded, a panel that says so takes the place of all others.
    """
    absent = import_module(".absent", __package__)
    try:
        for name in _INSTEAD if absent.reasons() else _TOOLS:
            import_module(f".{name}", __package__).register()
            _registered.append(name)
        _outlive_blender()
    except BaseException:
        unregister()
        raise


def unregister() -> None:
    """Undo `register`."""
    while _registered:
        import_module(f".{_registered.pop()}", __package__).unregister()


def _outlive_blender() -> None:
    """Keep these modules to the interpreter's end where Blender is a Python module of before 4.5.

    That one frees what it knows of classes after Python has freed the classes, and crashes when all work is done: the
    exit status of a script would be wrong. What hangs on `sys` is freed last.
    """
    import bpy

    if bpy.app.version < (4, 5, 0) and not bpy.app.binary_path:
        setattr(sys, __package__ or "", [module for name, module in sys.modules.items() if name.startswith(__name__)])
