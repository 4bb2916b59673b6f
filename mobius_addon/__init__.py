"""The Blender side: properties, operators, panel, mesh and attribute access, files and the command line.

No module here holds mathematics: each reads arrays from Blender, calls `solver` and writes arrays back.
"""

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
    "operators",
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
    except BaseException:
        unregister()
        raise


def unregister() -> None:
    """Undo `register`."""
    while _registered:
        import_module(f".{_registered.pop()}", __package__).unregister()
