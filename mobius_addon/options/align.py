"""Options of an alignment, named as in `solver.AlignSettings`."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy

from ...solver import AlignSettings
from .names import nameable

_DEFAULTS = AlignSettings()


class AlignOptions:
    """Mixin with the options of an alignment, named as in `solver.AlignSettings`, and where landmarks come from."""

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
    parts: bpy.props.EnumProperty(
        name="Parts",
        description="Which parts of meshes that have several are aligned",
        items=(
            ("all", "All", "Every part, as eyes, teeth and lashes, with its counterpart on the other mesh"),
            ("main", "Largest", "Only the largest part of each mesh"),
        ),
        default=_DEFAULTS.parts,
    )
    landmarks: bpy.props.EnumProperty(
        name="Landmarks",
        description="Pairs of points that are known; a few wrong ones do no harm",
        items=(
            ("none", "None", "The surfaces alone decide"),
            ("empties", "Empties", "Empties parented to source and target, with equal names but for .001 at the end"),
            ("groups", "Vertex Groups", "Vertex groups of equal names with a single vertex on either mesh"),
        ),
        default="none",
    )
    source_cut: bpy.props.StringProperty(
        name="Cut Source To",
        description="Vertex group or attribute around the piece of the source that is matched, such as a head; "
        "'seams': cut open along marked seams; empty: all of it, or where a body is too deep for a disc the piece that "
        "fits",
        search=nameable("source"),
        search_options={"SUGGESTION"},
    )
    target_cut: bpy.props.StringProperty(
        name="Cut Target To",
        description="Vertex group or attribute around the piece of the target that is matched, such as a head; "
        "'seams': cut open along marked seams; empty: all of it, or where a body is too deep for a disc the piece that "
        "fits",
        search=nameable("target"),
        search_options={"SUGGESTION"},
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

OF_SCENE = ("landmarks", "source_cut", "target_cut")
"""Those that name something of a scene, which no preset knows and the solver is told as numbers."""


def align_settings(
    options: Any, time_limit: float, outer: tuple[int | None, int | None] = (None, None)
) -> AlignSettings:
    """Return the solver's settings from an object that has `AlignOptions` and `ScanOptions`.

    A radius or time limit of 0 is none; `outer` are vertices on the outer loops of source and target.
    """
    chosen = {name: getattr(options, name) for name in ALIGN_OPTIONS if name not in OF_SCENE}
    chosen |= {"radius": options.radius or None, "time_limit": time_limit or None}
    return AlignSettings(**chosen, fill_holes=options.fill_holes, source_outer=outer[0], target_outer=outer[1])
