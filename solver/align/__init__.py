"""Two surfaces into one map: what stands for them in the search, what the search found, and how far to trust it.

The stages below are put in order here, partial overlaps cut out, rivals compared, and every point given a confidence.
"""

from .pipeline import align
from .result.alignment import Alignment
from .surfaces.prepared import Surface, prepare
from .surfaces.settings import AlignSettings
from .surfaces.surface_file import load_surface, save_surface

__all__ = ["AlignSettings", "Alignment", "Surface", "align", "load_surface", "prepare", "save_surface"]
