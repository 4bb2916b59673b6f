"""Options that operators and the scene's settings share, each defined once."""

# no postponed annotations here: Blender reads the properties from them
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ..solver import AlignSettings
from .attributes import KINDS, Mask, TransferSettings, mask_names, split_names
from .computation import Repair, selected_loop
from .mesh_data import Surface, foreach

_DEFAULTS = AlignSettings()


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
        description="Begin with the part of largest area. Without it, a mesh of several parts is refused",
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
    chosen = {name: getattr(options, name) for name in ALIGN_OPTIONS if name != "landmarks"}
    chosen |= {"radius": options.radius or None, "time_limit": time_limit or None}
    return AlignSettings(**chosen, fill_holes=options.fill_holes, source_outer=outer[0], target_outer=outer[1])


def enum_identifier(kind: str) -> str:
    """Return how Blender's enumerations spell a kind of data: 'vertex-groups' is 'VERTEX_GROUPS'."""
    return kind.upper().replace("-", "_")


def _nameable(role: str) -> Callable[[Any, bpy.types.Context, str], list[str]]:
    """Return what suggests names for a mask of the scene's source or target."""

    def suggest(_owner: Any, context: bpy.types.Context, _typed: str) -> list[str]:
        obj = getattr(context.scene.mobius, role)
        return [] if obj is None or obj.type != "MESH" else mask_names(obj)

    return suggest


_TRANSFER = TransferSettings()
_MASK_ITEMS = (
    ("none", "Everything", "Every vertex takes part"),
    ("selected", "Selection", "Vertices that are selected, as chosen in Edit Mode"),
    ("named", "By Name", "As a vertex group or an attribute says"),
)


class SourceMaskOptions:
    """Mixin with which part of the source counts; see `attributes.Mask`."""

    source_mask: bpy.props.EnumProperty(
        name="From", description="Which part of the source gives", items=_MASK_ITEMS, default=_TRANSFER.source_mask.by
    )
    source_mask_name: bpy.props.StringProperty(
        name="Source Mask",
        description="Vertex group or attribute of the source; what has at least half of the full weight gives",
        search=_nameable("source"),
        search_options={"SUGGESTION"},
    )
    source_mask_invert: bpy.props.BoolProperty(name="Invert", description="All but that part of the source gives")


class TransferOptions(SourceMaskOptions):
    """Mixin with the options of a transfer, named as in `attributes.TransferSettings`."""

    carry_to: bpy.props.EnumProperty(
        name="Carry To",
        description="Which meshes receive",
        items=(
            ("target", "Target", "The chosen target"),
            ("selected", "Selected", "All selected meshes, each through its own alignment with the source"),
        ),
        default="target",
    )
    kinds: bpy.props.EnumProperty(
        name="Data",
        description="What to carry from the source to the target",
        items=tuple((enum_identifier(kind.identifier), kind.label, kind.description) for kind in KINDS),
        options={"ENUM_FLAG"},
        default={enum_identifier(kind) for kind in _TRANSFER.kinds},
    )
    layers: bpy.props.EnumProperty(
        name="Layers",
        description="Which of the source's vertex groups, shape keys, UV maps, colors and attributes to carry",
        items=(
            ("all", "All", "All of the chosen kinds"),
            ("active", "Active", "The active one of each chosen kind"),
            ("named", "By Name", "Those whose names are given"),
        ),
        default=_TRANSFER.layers,
    )
    layer_names: bpy.props.StringProperty(
        name="Names",
        description="Names of layers to carry, with commas between; * and ? stand for any characters",
    )
    deform_only: bpy.props.BoolProperty(
        name="Only Deform Bones",
        description="Of the vertex groups, carry those that belong to a deforming bone of an armature of either mesh",
        default=_TRANSFER.deform_only,
    )
    collisions: bpy.props.EnumProperty(
        name="Same Name",
        description="What happens to a layer of the target's own that has the name of one that is carried, where the "
        "two differ. What an earlier transfer wrote is made anew unless it was edited since",
        items=(
            ("replace", "Replace", "The carried layer takes its place"),
            ("number", "Keep Both", "It stays, and the carried layer gets a number, as in 'UVMap.001'. What a mesh has "
             "once, as materials and seams, is replaced"),
        ),
        default=_TRANSFER.collisions,
    )  # fmt: skip
    mix: bpy.props.EnumProperty(
        name="Mix",
        description="How weights, shapes, colors, masks and other interpolated values join those that are there",
        items=(
            ("replace", "Replace", "The carried value instead of the one that is there"),
            ("add", "Add", "Their sum"),
            ("subtract", "Subtract", "The one that is there less the carried one"),
            ("multiply", "Multiply", "Their product"),
        ),
        default=_TRANSFER.mix,
    )
    mix_factor: bpy.props.FloatProperty(
        name="Mix Factor",
        description="How far to go from what is there to the result",
        default=_TRANSFER.mix_factor,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    limit: bpy.props.IntProperty(
        name="Limit Groups",
        description="Keep the strongest so many of the carried vertex groups at each vertex; 0: all",
        default=_TRANSFER.limit,
        min=0,
        soft_max=16,
    )
    normalize: bpy.props.BoolProperty(
        name="Normalize",
        description="Scale the carried weights of each vertex to the sum 1; locked groups of the target count and stay",
        default=_TRANSFER.normalize,
    )
    smallest_weight: bpy.props.FloatProperty(
        name="Smallest Weight",
        description="Vertices with less weight than this do not become members of a vertex group",
        default=_TRANSFER.smallest_weight,
        min=0.0,
        max=0.99,
        soft_max=0.1,
        precision=4,
    )
    target_mask: bpy.props.EnumProperty(
        name="To", description="Which part of the target receives", items=_MASK_ITEMS, default=_TRANSFER.target_mask.by
    )
    target_mask_name: bpy.props.StringProperty(
        name="Target Mask",
        description="Vertex group or attribute of the target; what can be mixed is mixed by it, anything else is "
        "carried to where it is at least half",
        search=_nameable("target"),
        search_options={"SUGGESTION"},
    )
    target_mask_invert: bpy.props.BoolProperty(name="Invert", description="All but that part of the target receives")
    unmatched: bpy.props.EnumProperty(
        name="Unmatched",
        description="What vertices get that correspond to nothing with certainty. 'Select Unmatched' shows them",
        items=(
            ("carry", "Carry Anyway", "What the map brings there, however uncertain"),
            ("leave", "Leave", "They keep what they have"),
            ("nearest", "Nearest", "The value of the nearest vertex that is matched, along the surface"),
            ("fill", "Smooth Fill", "A harmonic fill between the matched vertices around; the nearest value where "
             "values cannot be mixed"),
        ),
        default=_TRANSFER.unmatched,
    )  # fmt: skip
    evaluated: bpy.props.BoolProperty(
        name="Evaluated Source",
        description="Read the source as its modifiers and the current mix of its shape keys show it, instead of the "
        "original mesh. Shape keys are the original's",
        default=_TRANSFER.evaluated,
    )


SOURCE_MASK_OPTIONS = tuple(SourceMaskOptions.__annotations__)
TRANSFER_OPTIONS = (*SOURCE_MASK_OPTIONS, *TransferOptions.__annotations__)


def draw_transfer(layout: bpy.types.UILayout, options: Any) -> None:
    """Draw what of the chosen kinds is carried, how it joins what is there, and where."""
    column = layout.column()
    column.prop(options, "layers")
    if options.layers == "named":
        column.prop(options, "layer_names")
    column.prop(options, "collisions")
    column = layout.column()
    column.prop(options, "mix")
    column.prop(options, "mix_factor", text="Factor")
    column = layout.column()
    for role in ("source_mask", "target_mask"):
        row = column.row(align=True)
        row.prop(options, role)
        if getattr(options, role) != "none":
            row.prop(options, f"{role}_invert", text="", icon="ARROW_LEFTRIGHT")
        if getattr(options, role) == "named":
            column.prop(options, f"{role}_name", text=" ")
    column.prop(options, "unmatched")
    column = layout.column(heading="Vertex Groups")
    column.prop(options, "deform_only")
    column.prop(options, "normalize")
    column.prop(options, "limit")
    column.prop(options, "smallest_weight")
    layout.column(heading="Source").prop(options, "evaluated", text="As Evaluated")


def source_mask(options: Any) -> Mask:
    """Return the mask of the source from an object that has `SourceMaskOptions`."""
    return Mask(options.source_mask, options.source_mask_name, options.source_mask_invert)


def transfer_settings(options: Any) -> TransferSettings:
    """Return the settings from an object that has `TransferOptions`."""
    kinds = tuple(kind.identifier for kind in KINDS if enum_identifier(kind.identifier) in options.kinds)
    receives = Mask(options.target_mask, options.target_mask_name, options.target_mask_invert)
    own = ("layers", "deform_only", "collisions", "mix", "mix_factor", "limit", "normalize", "smallest_weight")
    own += ("unmatched", "evaluated")
    names = split_names(options.layer_names)
    masks = {"source_mask": source_mask(options), "target_mask": receives}
    return TransferSettings(kinds=kinds, names=names, **masks, **{name: getattr(options, name) for name in own})
