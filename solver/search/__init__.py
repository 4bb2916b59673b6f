"""The certified search: the Möbius transformation that brings most of the source into match discs of the target.

Branch and bound over all transformations with |z| <= z_max, ending with a bound that holds in floating-point
arithmetic; knows points of two discs and nothing of surfaces (Le, Chin and Suter 2016). `sphere_search`
is the same for points of two spheres.
"""

from .branch_and_bound import search
from .outcome import SearchResult, SphereSearchResult
from .sphere_search import sphere_search

__all__ = ["SearchResult", "SphereSearchResult", "search", "sphere_search"]
