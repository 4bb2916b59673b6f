"""Blender extension: certified conformal correspondence between two surfaces.

Nothing is imported before Blender registers the extension, so that `solver` and the tests load without bpy.
"""


def register() -> None:
    """Register every class, menu and command of the extension."""
    from .mobius_addon import register as register_addon

    register_addon()


def unregister() -> None:
    """Undo `register`: no class, handler, timer or command stays behind."""
    from .mobius_addon import unregister as unregister_addon

    unregister_addon()
