"""Registering classes, with tooltips from their docstrings."""

from collections.abc import Callable

import bpy


def register_factory(classes: tuple[type, ...]) -> tuple[Callable[[], None], Callable[[], None]]:
    """Return what registers and what unregisters classes. Operators' tooltips are their docstrings.

    Blender ends every tooltip with a full stop of its own, so that the docstring's has to go.
    """
    for cls in classes:
        if issubclass(cls, bpy.types.Operator):
            cls.bl_description = " ".join((cls.__doc__ or "").split()).removesuffix(".")
    return bpy.utils.register_classes_factory(classes)
