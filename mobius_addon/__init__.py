"""The Blender side: properties, operators, panel, mesh and attribute access, files and the command line.

No module here holds mathematics: each reads arrays from Blender, calls `solver` and writes arrays back.
"""

from importlib import import_module

# in the order in which they register; each has `register` and `unregister`
_MODULES = ("preferences", "properties", "operators", "panel", "command_line")


def register() -> None:
    """Register every class, property and command; nothing stays registered if one of them fails."""
    done: list[str] = []
    try:
        for name in _MODULES:
            import_module(f".{name}", __package__).register()
            done.append(name)
    except BaseException:
        for name in reversed(done):
            import_module(f".{name}", __package__).unregister()
        raise


def unregister() -> None:
    """Undo `register`."""
    for name in reversed(_MODULES):
        import_module(f".{name}", __package__).unregister()
