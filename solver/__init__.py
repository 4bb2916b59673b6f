"""Certified conformal correspondence between two triangulated discs, over plain arrays.

In the order of the pipeline, and of the folders, each of which imports only from those before it: a `TriangleMesh` is
checked and measured (`surface`), flattened (`flatten`), searched for the best `Mobius` transformation (`search`), bent
onto the other surface (`bend`), aligned as a whole (`align`) and turned into a dense map that carries values (`carry`).
Many surfaces at once are a `collection`.
"""

from .align import Alignment, AlignSettings, Surface, align, load_surface, prepare, save_surface
from .carry import Correspondence, correspond, interpolate, interpolate_corners, load_map, report, save_map
from .flatten import Distortion, Flattening, SphereFlattening, flatten, flatten_sphere, silhouette_mesh
from .mobius import Mobius, SphereMobius
from .search import SearchResult, SphereSearchResult, search, sphere_search
from .stages import Cancelled, Progress, SearchProgress
from .surface import Cleaned, MeshError, Topology, TriangleMesh, Verdict, cleaned, require_disc, topology, verdict

__all__ = [
    "AlignSettings",
    "Alignment",
    "Cancelled",
    "Cleaned",
    "Correspondence",
    "Distortion",
    "Flattening",
    "MeshError",
    "Mobius",
    "Progress",
    "SearchProgress",
    "SearchResult",
    "SphereFlattening",
    "SphereMobius",
    "SphereSearchResult",
    "Surface",
    "Topology",
    "TriangleMesh",
    "Verdict",
    "align",
    "cleaned",
    "correspond",
    "flatten",
    "flatten_sphere",
    "interpolate",
    "interpolate_corners",
    "load_map",
    "load_surface",
    "prepare",
    "report",
    "require_disc",
    "save_map",
    "save_surface",
    "search",
    "silhouette_mesh",
    "sphere_search",
    "topology",
    "verdict",
]
