"""Certified conformal correspondence between two triangulated discs, over plain arrays.

In the order of the pipeline: a `TriangleMesh` is checked (`topology`), flattened (`flatten`), searched for the best
`Mobius` transformation (`search`), aligned as a whole (`align`) and turned into a dense map (`correspond`) that carries
values (`interpolate`).
"""

from .align import align
from .alignment import Alignment, AlignSettings
from .circle_packing import silhouette_mesh
from .cleaning import Cleaned, cleaned
from .correspond import Correspondence, correspond
from .distortion import Distortion
from .flatten import Flattening, flatten
from .interpolate import interpolate, interpolate_corners
from .map_file import load_map, save_map
from .mesh import MeshError, TriangleMesh
from .mobius import Mobius
from .report import report
from .search import SearchProgress, SearchResult, search
from .stages import Cancelled, Progress
from .topology import Topology, require_disc, topology

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
    "Topology",
    "TriangleMesh",
    "align",
    "cleaned",
    "correspond",
    "flatten",
    "interpolate",
    "interpolate_corners",
    "load_map",
    "report",
    "require_disc",
    "save_map",
    "search",
    "silhouette_mesh",
    "topology",
]
