"""The dense map, and whatever is carried through it: values at vertices, corners, edges and faces, and directions.

A `Correspondence` is a point of the source for each vertex of the target; here it is made, used, saved and reported.
"""

from .corners import interpolate_corners
from .correspond import Correspondence, correspond
from .interpolate import interpolate
from .map_file import load_map, save_map
from .report import report

__all__ = ["Correspondence", "correspond", "interpolate", "interpolate_corners", "load_map", "report", "save_map"]
