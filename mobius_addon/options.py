"""Options that operators and the scene's settings share, each defined once."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy
import numpy as np

from ..solver import AlignSettings, TriangleMesh
from .attributes import KINDS
from .computation import Repair, selected_loop
from .mesh_data import foreach

_DEFAULTS = AlignSettings()


class ScanOptions:
    """Mixin with what to do about a scan's flaws; see `computation.Repair`."""

    fill_holes: bpy.props.BoolProperty(
        name="Fill Holes",
        description="Accept a mesh with openings, such as a mouth: all but the outer one are closed for the "
        "computation. The mesh itself stays as it is",
        default=False,
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
        default=False,
    )


SCAN_OPTIONS = tuple(ScanOptions.__annotations__)


def repair(options: Any) -> Repair:
    """Return what to do about a scan's flaws from an object that has `ScanOptions`."""
    return Repair(options.fill_holes, options.largest_part)


def outer_vertex(obj: bpy.types.Object, mesh: TriangleMesh, options: Any) -> int | None:
    """Return a vertex of the boundary loop that is chosen as the outer one, None for the longest.

    Raises
    ------
    Refusal
        As `computation.selected_loop`.
    """
    if not options.fill_holes or options.outer_loop == "longest":
        return None
    return selected_loop(mesh, foreach(obj.data.vertices, "select", 1, np.bool_), repair(options))


class AlignOptions:
    """Mixin with the options of an alignment, named as in `solver.AlignSettings`."""

    reflect: bpy.props.EnumProperty(
        name="Mirrored",
        description="Whether the target may be the mirror image of the source",
        items=(
            ("auto", "Detect", "Search both ways; the mirrored one is taken only if it wins clearly"),
            ("never", "No", "Left is left on both"),
            ("always", "Yes", "The target is the mirror image of the source, like a left and a right tooth"),
        ),
        default=_DEFAULTS.reflect,
    )
    refine: bpy.props.EnumProperty(
        name="Refinement",
        description="How the map that the search proved best is improved",
        items=(
            ("dense", "Dense", "The target is then bent onto the source, without folds: the most accurate"),
            ("mobius", "Möbius", "The best conformal map nearby, tuned on all vertices"),
            ("none", "None", "Exactly the map of the certificate"),
        ),
        default=_DEFAULTS.refine,
    )
    samples: bpy.props.IntProperty(
        name="Samples",
        description="Points of the source that the search matches; more are slower and tell more places apart",
        default=_DEFAULTS.samples,
        min=3,
        soft_min=20,
        soft_max=400,
    )
    targets: bpy.props.IntProperty(
        name="Target Points",
        description="Points that stand for the target in the search; more are slower and more accurate",
        default=_DEFAULTS.targets,
        min=3,
        soft_min=200,
        soft_max=5000,
    )
    radius: bpy.props.FloatProperty(
        name="Match Radius",
        description="How near matched points have to be, as hyperbolic distance in the disc; "
        "0: as far as the target points lie from each other",
        default=_DEFAULTS.radius or 0.0,
        min=0.0,
        max=0.9,
        precision=3,
    )
    z_max: bpy.props.FloatProperty(
        name="Search Range",
        description="How far apart the centres of the two discs may lie; what is proved is proved for this range",
        default=_DEFAULTS.z_max,
        min=0.01,
        max=0.999,
        precision=3,
    )


ALIGN_OPTIONS = tuple(AlignOptions.__annotations__)


def align_settings(
    options: Any, time_limit: float, outer: tuple[int | None, int | None] = (None, None)
) -> AlignSettings:
    """Return the solver's settings from an object that has `AlignOptions` and `ScanOptions`.

    A radius or time limit of 0 is none; `outer` are vertices on the outer loops of source and target.
    """
    chosen = {name: getattr(options, name) for name in ALIGN_OPTIONS}
    chosen |= {"radius": options.radius or None, "time_limit": time_limit or None}
    return AlignSettings(**chosen, fill_holes=options.fill_holes, source_outer=outer[0], target_outer=outer[1])


def enum_identifier(kind: str) -> str:
    """Return how Blender's enumerations spell a kind of data: 'vertex-groups' is 'VERTEX_GROUPS'."""
    return kind.upper().replace("-", "_")


class TransferOptions:
    """Mixin with the options of a transfer."""

    kinds: bpy.props.EnumProperty(
        name="Data",
        description="What to carry from the source to the target",
        items=tuple((enum_identifier(kind.identifier), kind.label, kind.description) for kind in KINDS),
        options={"ENUM_FLAG"},
        default={enum_identifier(kind.identifier) for kind in KINDS},
    )


def chosen_kinds(options: Any) -> list[str]:
    """Return the identifiers of the chosen `KINDS` from an object that has `TransferOptions`."""
    return [kind.identifier for kind in KINDS if enum_identifier(kind.identifier) in options.kinds]
