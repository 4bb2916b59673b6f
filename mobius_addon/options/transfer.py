"""Options of a transfer, named as in `attributes.TransferSettings`."""

# no postponed annotations here: Blender reads the properties from them
from typing import Any

import bpy

from ..attributes import KINDS, Mask, TransferSettings, split_names
from ..textures.settings import SIZES, TextureSettings
from .kind_switches import KindSwitches, enum_identifier
from .names import nameable

_TRANSFER = TransferSettings()
_TEXTURES = TextureSettings()
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
        search=nameable("source"),
        search_options={"SUGGESTION"},
    )
    source_mask_invert: bpy.props.BoolProperty(name="Invert", description="All but that part of the source gives")


class TransferOptions(KindSwitches, SourceMaskOptions):
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
        search=nameable("target"),
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
    keys_by: bpy.props.EnumProperty(
        name="Fit",
        description="How shape keys get the directions and proportions of the target",
        items=(
            ("gradients", "Whole Shape", "What is stretched or turned on the source is so on the target; the rest "
             "follows smoothly"),
            ("frames", "Each Vertex", "Each vertex moves as the surface right around it is turned and scaled"),
        ),
        default=_TRANSFER.keys_by,
    )  # fmt: skip
    contacts: bpy.props.BoolProperty(
        name="Keep Contacts",
        description="Lids and lips that a shape key closes on the source are closed on the target too",
        default=_TRANSFER.contacts,
    )
    rig: bpy.props.BoolProperty(
        name="Carry the Rig",
        description="Give the target a copy of the armature that moves the source, its joints where they belong in the "
        "target, as modifier and parent as the source has it",
        default=_TRANSFER.rig,
    )
    spelling: bpy.props.EnumProperty(
        name="Rename",
        description="How known expressions are called on the target",
        items=(
            ("keep", "As on the Source", "Names stay as they are"),
            ("arkit", "eyeBlinkLeft", "As ARKit calls its 52, and visemes as Oculus does"),
            ("underscore", "eyeBlink_L", "The same with _L and _R for the sides"),
            ("dot", "eyeBlink.L", "The same with .L and .R, which Blender's own mirror tools know"),
        ),
        default=_TRANSFER.spelling,
    )
    halves: bpy.props.BoolProperty(
        name="Split Sides",
        description="Expressions that are one for both sides, as browInnerUp, become two, left and right",
        default=_TRANSFER.halves,
    )
    symmetric: bpy.props.BoolProperty(
        name="Symmetric",
        description="Shape keys that are nearly symmetric, and such of left and right that are nearly mirror images of "
        "each other, are so exactly, where the target is symmetric",
        default=_TRANSFER.symmetric,
    )
    evaluated: bpy.props.BoolProperty(
        name="Evaluated Source",
        description="Read the source as its modifiers and the current mix of its shape keys show it, instead of the "
        "original mesh. Shape keys are the original's",
        default=_TRANSFER.evaluated,
    )
    texture_size: bpy.props.IntProperty(
        name="Size",
        description="Side of the pictures in texels; 0: as many as the source has on the part that the target shows",
        default=_TEXTURES.size,
        min=0,
        soft_max=8192,
        max=SIZES[1],
    )
    texture_layout: bpy.props.EnumProperty(
        name="Layout",
        description="Which UV map the pictures are for",
        items=(
            ("auto", "Automatic", "The target's own if it has one, else the source's, else the disc"),
            ("own", "Own", "The UV map that the target is rendered with"),
            ("carried", "Carried", "The source's, carried over"),
            ("disc", "Disc", "The conformal map of the target to a disc"),
        ),
        default=_TEXTURES.layout,
    )
    texture_margin: bpy.props.IntProperty(
        name="Margin",
        description="Texels added around islands; -1: a 256th of the size",
        default=_TEXTURES.margin,
        min=-1,
        soft_max=64,
    )
    texture_result: bpy.props.EnumProperty(
        name="Result",
        description="What becomes of the pictures",
        items=(
            ("pictures", "Pictures", "Pictures in a new material, packed into the file"),
            ("attributes", "Color Attributes", "What they show at the target's vertices"),
        ),
        default=_TEXTURES.result,
    )
    texture_mask: bpy.props.BoolProperty(
        name="Mask of Unmatched",
        description="A further picture, white where the target has no certain counterpart",
        default=_TEXTURES.mask,
    )


SOURCE_MASK_OPTIONS = tuple(SourceMaskOptions.__annotations__)
TRANSFER_OPTIONS = (*SOURCE_MASK_OPTIONS, *TransferOptions.__annotations__)


def source_mask(options: Any) -> Mask:
    """Return the mask of the source from an object that has `SourceMaskOptions`."""
    return Mask(options.source_mask, options.source_mask_name, options.source_mask_invert)


def transfer_settings(options: Any) -> TransferSettings:
    """Return the settings from an object that has `TransferOptions`."""
    kinds = tuple(kind.identifier for kind in KINDS if enum_identifier(kind.identifier) in options.kinds)
    receives = Mask(options.target_mask, options.target_mask_name, options.target_mask_invert)
    own = ("layers", "deform_only", "collisions", "mix", "mix_factor", "limit", "normalize", "smallest_weight")
    own += ("unmatched", "keys_by", "contacts", "rig", "spelling", "halves", "symmetric", "evaluated")
    names = split_names(options.layer_names)
    masks = {"source_mask": source_mask(options), "target_mask": receives}
    textures = TextureSettings(
        max(options.texture_size, SIZES[0]) if options.texture_size else 0,
        options.texture_layout,
        options.texture_margin,
        options.texture_result,
        options.texture_mask,
    )
    return TransferSettings(
        kinds=kinds, names=names, textures=textures, **masks, **{name: getattr(options, name) for name in own}
    )
