"""What a triangle mesh is: its topology and flaws, its intrinsic operators, and points and curvatures on it.

The stages above ask here for everything that concerns one surface as it lies in space, before any map of it.
"""

from .cleaning import cleaned
from .mesh import MeshError, TriangleMesh
from .tidy import Cleaned
from .topology import Topology, require_disc, topology
from .verdict import Verdict, verdict

__all__ = [
    "Cleaned",
    "MeshError",
    "Topology",
    "TriangleMesh",
    "Verdict",
    "cleaned",
    "require_disc",
    "topology",
    "verdict",
]
