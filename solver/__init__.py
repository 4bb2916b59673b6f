"""Certified conformal correspondence between two triangulated discs, over plain arrays.

In the order of the pipeline: a `TriangleMesh` is checked (`topology`), flattened (`flatten`), searched for the best
`Mobius` transformation (`search`), aligned as a whole (`align`) and turned into a dense map (`correspond`) that carries
values (`interpolate`).
"""

from .flatten import Flattening, flatten
from .mesh import MeshError, TriangleMesh
from .mobius import Mobius
from .search import SearchProgress, SearchResult, search
from .topology import Topology, require_disc, topology

__all__ = [
    "Flattening",
    "MeshError",
    "Mobius",
    "SearchProgress",
    "SearchResult",
    "Topology",
    "TriangleMesh",
    "flatten",
    "require_disc",
    "search",
    "topology",
]
