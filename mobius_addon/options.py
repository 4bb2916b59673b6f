"""Options that operators and the scene's settings share, each defined once."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy

from ..solver import AlignSettings
from .attributes import KINDS

_DEFAULTS = AlignSettings()


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


def align_settings(options: Any, time_limit: float) -> AlignSettings:
    """Return the solver's settings from an object that has `AlignOptions`; a radius or time limit of 0 is none."""
    chosen = {name: getattr(options, name) for name in ALIGN_OPTIONS}
    return AlignSettings(**chosen | {"radius": options.radius or None, "time_limit": time_limit or None})


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
