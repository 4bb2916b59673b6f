"""What commands are told about a mesh: its file, and how a scan is mended for the computation."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..mesh_data import Surface

MESH_HELP = (
    "any file Blender imports (.blend .obj .ply .stl .glb .gltf .vrm .fbx .usd), or .off .vtk .gii; "
    "FILE:OBJECT names an object"
)
OUTER_HELP = "number, from 0, of a vertex on the outer boundary; default: the longest boundary"


def add_repair_options(group: argparse._ArgumentGroup) -> None:
    """Add what mends a scan for the computation."""
    openings = group.add_mutually_exclusive_group()
    openings.add_argument(
        "--fill-holes",
        action="store_true",
        default=True,
        help="close all boundaries but the outer one for the computation, and cut small handles: what happens anyway",
    )
    openings.add_argument(
        "--keep-holes", dest="fill_holes", action="store_false", help="refuse a mesh with openings or handles"
    )
    parts = group.add_mutually_exclusive_group()
    parts.add_argument(
        "--largest-part",
        action="store_true",
        default=True,
        help="begin with the part of largest area: what happens anyway",
    )
    parts.add_argument("--keep-parts", dest="largest_part", action="store_false", help="refuse a mesh of several parts")


def require_outer(vertex: int | None, options: argparse.Namespace, role: str, surface: Surface) -> None:
    """Raise `Unreadable` if a vertex that was named for the outer boundary cannot be on one."""
    from ..files import Unreadable

    if vertex is None:
        return
    if not options.fill_holes:
        raise Unreadable(f"{role} chooses among several boundaries, which --keep-holes refuses: leave that out")
    count = len(surface.mesh.vertices)
    if not 0 <= vertex < count:
        raise Unreadable(f"{role} {vertex}: '{surface.mesh.name}' has the vertices 0 to {count - 1:,}")
