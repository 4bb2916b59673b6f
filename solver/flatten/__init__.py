"""Conformal maps of a surface to the unit disc or sphere: ways to them, what they distort, where a point lies.

Two such maps of one surface differ by a Möbius transformation, which is all that the search has left to find.
"""

from .circle_packing import silhouette_mesh
from .distortion import Distortion
from .flatten import Flattening, flatten
from .sphere import SphereFlattening, flatten_sphere

__all__ = ["Distortion", "Flattening", "SphereFlattening", "flatten", "flatten_sphere", "silhouette_mesh"]
