"""The commands without a window: `python . COMMAND` and, installed, `blender --command mobius COMMAND`.

Each is a module with its `HELP`, `add_arguments` and `run`, which gives the exit status. Blender is imported when a
command runs, not before, so that help and wrong usage need nothing.
"""

from .guarded import guarded
from .program import main, main_quietly
from .registration import register, unregister

__all__ = ["guarded", "main", "main_quietly", "register", "unregister"]
