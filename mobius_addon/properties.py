"""What the extension keeps.

Choices in the scene; on a mesh its last alignment as target, and which layers were active before ours; what the overlay
draws.
"""

# no postponed annotations here: Blender reads the properties from them
import bpy

from . import overlay
from .comparison import is_copy
from .live import samplable
from .options import AlignOptions, ScanOptions, TransferOptions
from .proof import MobiusProof
from .usable import is_in_scene


def _is_choosable(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    return obj.type == "MESH" and not is_copy(obj) and is_in_scene(obj, settings.id_data)


def _names_to_sample(settings: bpy.types.PropertyGroup, _context: bpy.types.Context, _typed: str) -> list[str]:
    source = settings.source
    return [] if source is None or source.type != "MESH" else samplable(source)


def _source_changed(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Forget the name of what the target follows where another source has nothing of that name."""
    names = _names_to_sample(settings, context, "")
    if settings.live_attribute and settings.source is not None and settings.live_attribute not in names:
        settings.property_unset("live_attribute")


class MobiusSettings(AlignOptions, ScanOptions, TransferOptions, bpy.types.PropertyGroup):
    """What a person chose in the panel; one per scene."""

    source: bpy.props.PointerProperty(
        name="Source",
        description="Mesh to carry data from",
        type=bpy.types.Object,
        poll=_is_choosable,
        update=_source_changed,
    )
    target: bpy.props.PointerProperty(
        name="Target",
        description="Mesh to carry data to",
        type=bpy.types.Object,
        poll=_is_choosable,
    )
    proof: bpy.props.PointerProperty(
        name="Proof", description="What is proved about the alignment of the chosen pair", type=MobiusProof
    )
    live_attribute: bpy.props.StringProperty(
        name="Attribute",
        description="Vertex group or attribute of the source that the target follows",
        search=_names_to_sample,
        search_options={"SUGGESTION"},
    )


class MobiusAlignment(bpy.types.PropertyGroup):
    """The last alignment of a mesh as target, as `stored_alignment` keeps it.

    The source is told by its name, its number of vertices and its fingerprint: a pointer would keep it in the file for
    ever.
    """

    source: bpy.props.PointerProperty(type=bpy.types.Object)  # of version 0.1 only: see `earlier_version`
    source_name: bpy.props.StringProperty()
    source_size: bpy.props.IntProperty()
    source_fingerprint: bpy.props.StringProperty()
    target_fingerprint: bpy.props.StringProperty()
    value: bpy.props.FloatProperty()
    upper_bound: bpy.props.FloatProperty()
    certified: bpy.props.BoolProperty()
    reflected: bpy.props.BoolProperty()
    coverage: bpy.props.FloatProperty()
    seconds: bpy.props.FloatProperty()
    report: bpy.props.StringProperty()
    packed: bpy.props.StringProperty(subtype="BYTE_STRING")
    unbent: bpy.props.StringProperty(subtype="BYTE_STRING")  # before it was bent through point pairs
    pairs: bpy.props.StringProperty()  # as `point_pairs` keeps them


def _show_or_hide(_view: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    overlay.follow(context)


class MobiusView(bpy.types.PropertyGroup):
    """What the overlay draws; of the session, not of the file."""

    matches: bpy.props.BoolProperty(
        name="Matched Points",
        description="Draw matched points of source and target and lines between them, each in a color of its own",
        default=False,
        update=_show_or_hide,
    )
    count: bpy.props.IntProperty(
        name="Points",
        description="How many matched points are drawn, spread evenly over the target",
        default=20,
        min=1,
        soft_max=2000,
        max=20000,
        update=_show_or_hide,
    )
    lines: bpy.props.FloatProperty(
        name="Opacity",
        description="How opaque the lines between matched points are; 0: only the points are drawn",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_show_or_hide,
    )
    discs: bpy.props.BoolProperty(
        name="Discs in UV Editors",
        description="Draw the two discs in the shared layout in every UV editor, also in Object Mode",
        default=False,
        update=_show_or_hide,
    )
    legend: bpy.props.BoolProperty(
        name="Legend",
        description="Say in the viewport what the colors of a heat map mean, while one is the active color attribute "
        "of the active object or of the target",
        default=False,
        update=_show_or_hide,
    )


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (MobiusProof, MobiusSettings, MobiusAlignment, MobiusView)
)


def register() -> None:
    """Register the property groups and hang them on scenes, meshes and the window manager."""
    _register_classes()
    bpy.types.Scene.mobius = bpy.props.PointerProperty(type=MobiusSettings)
    bpy.types.Mesh.mobius_alignment = bpy.props.PointerProperty(type=MobiusAlignment)
    bpy.types.Mesh.mobius_before = bpy.props.StringProperty()  # as `attributes.note` keeps it
    bpy.types.Mesh.mobius_transferred = bpy.props.StringProperty()  # as `last_transfer` keeps it
    bpy.types.WindowManager.mobius_view = bpy.props.PointerProperty(type=MobiusView)


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.WindowManager.mobius_view
    del bpy.types.Mesh.mobius_transferred
    del bpy.types.Mesh.mobius_before
    del bpy.types.Mesh.mobius_alignment
    del bpy.types.Scene.mobius
    _unregister_classes()
