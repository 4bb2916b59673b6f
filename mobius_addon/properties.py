"""What the extension keeps: choices in the scene, the last alignment on the target's mesh, work under way."""

# no postponed annotations here: Blender reads the properties from them
import bpy

from . import topology_cache
from .options import AlignOptions, ScanOptions, TransferOptions
from .usable import is_in_scene


def _is_choosable(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    return obj.type == "MESH" and is_in_scene(obj, settings.id_data)


class MobiusSettings(AlignOptions, ScanOptions, TransferOptions, bpy.types.PropertyGroup):
    """What a person chose in the panel; one per scene."""

    source: bpy.props.PointerProperty(
        name="Source",
        description="Mesh to carry data from",
        type=bpy.types.Object,
        poll=_is_choosable,
    )
    target: bpy.props.PointerProperty(
        name="Target",
        description="Mesh to carry data to",
        type=bpy.types.Object,
        poll=_is_choosable,
    )


class MobiusAlignment(bpy.types.PropertyGroup):
    """The last alignment of a mesh as target, as `stored_alignment` keeps it."""

    source: bpy.props.PointerProperty(type=bpy.types.Object)
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


class MobiusJob(bpy.types.PropertyGroup):
    """Work under way in the window, for the panel to draw; not saved."""

    title: bpy.props.StringProperty()
    text: bpy.props.StringProperty()
    proved: bpy.props.StringProperty()
    fraction: bpy.props.FloatProperty()
    running: bpy.props.BoolProperty()

    def start(self, title: str) -> None:
        """Begin to show work."""
        self.title, self.text, self.proved, self.fraction, self.running = title, "Starting", "", 0.0, True

    def show(self, text: str, proved: str, fraction: float) -> bool:
        """Show where the work is and what is proved so far, and return whether that is news."""
        if (text, proved, round(fraction, 2)) == (self.text, self.proved, round(self.fraction, 2)):
            return False
        self.text, self.proved, self.fraction = text, proved, fraction
        return True

    def stop(self) -> None:
        """Show nothing any more."""
        self.running = False


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (MobiusSettings, MobiusAlignment, MobiusJob)
)


def register() -> None:
    """Register the property groups and hang them on scenes, meshes and the window manager."""
    _register_classes()
    bpy.types.Scene.mobius = bpy.props.PointerProperty(type=MobiusSettings)
    bpy.types.Mesh.mobius_alignment = bpy.props.PointerProperty(type=MobiusAlignment)
    bpy.types.WindowManager.mobius_job = bpy.props.PointerProperty(type=MobiusJob)
    topology_cache.register()


def unregister() -> None:
    """Undo `register`."""
    topology_cache.unregister()
    del bpy.types.WindowManager.mobius_job
    del bpy.types.Mesh.mobius_alignment
    del bpy.types.Scene.mobius
    _unregister_classes()
