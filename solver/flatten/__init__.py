"""Conformal maps of a surface to the unit disc: three ways to them, what they distort, and where a point of them lies.

Two such maps of one surface differ by a Möbius transformation, which is all that the search has left to find.
"""

from .circle_packing import silhouette_mesh
from .distortion import Distortion
from .flatten import Flattening, flatten

__all__ = ["Distortion", "Flattening", "flatten", "silhouette_mesh"]
