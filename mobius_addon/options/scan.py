"""What to do about a scan's flaws."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy
import numpy as np

from ..computation import Repair, selected_loop
from ..mesh_data import Surface, foreach


class ScanOptions:
    """Mixin with what to do about a scan's flaws; see `computation.Repair`."""

    fill_holes: bpy.props.BoolProperty(
        name="Fill Holes",
        description="Close openings, such as a mouth, all but the outer one, and cut small handles, for the "
        "computation. The mesh itself stays as it is",
        default=True,
    )
    outer_loop: bpy.props.EnumProperty(
        name="Outer Boundary",
        description="Which boundary loop becomes the rim of the disc, where Fill Holes finds several",
        items=(
            ("longest", "Longest", "The longest boundary loop"),
            ("selected", "Selected", "The boundary loop that has selected vertices, as chosen in Edit Mode"),
        ),
        default="longest",
    )
    largest_part: bpy.props.BoolProperty(
        name="Largest Part",
        description="Leave all separate parts but the one of largest area out of the computation",
        default=True,
    )


SCAN_OPTIONS = tuple(ScanOptions.__annotations__)


def repair(options: Any) -> Repair:
    """Return what to do about a scan's flaws from an object that has `ScanOptions`."""
    return Repair(options.fill_holes, options.largest_part)


def outer_vertex(obj: bpy.types.Object, surface: Surface, options: Any) -> int | None:
    """Return a vertex of the boundary loop that is chosen as the outer one, None for the longest.

    Raises
    ------
    Refusal
        As `computation.selected_loop`.
    """
    if not options.fill_holes or options.outer_loop == "longest":
        return None
    selected = foreach(obj.data.vertices, "select", 1, np.bool_)
    return selected_loop(surface.mesh, selected, repair(options), surface.keys)
