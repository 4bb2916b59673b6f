"""The add-on's settings: what depends on the person's machine and patience, not on the scene."""

import bpy

from ..solver import AlignSettings

ROOT_PACKAGE = __name__.rpartition(".mobius_addon")[0]


class MOBIUS_AP_preferences(bpy.types.AddonPreferences):
    """Settings of the extension."""

    bl_idname = ROOT_PACKAGE

    time_limit: bpy.props.FloatProperty(
        name="Time Limit",
        description="Seconds after which a search stops and reports how far its result is from proven; 0: no limit",
        default=AlignSettings().time_limit or 0.0,
        min=0.0,
        soft_max=600.0,
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
    )
    check_while_drawing: bpy.props.BoolProperty(
        name="Check Chosen Meshes",
        description="Say under each chosen mesh whether it is a disc as soon as it is chosen or edited",
        default=True,
    )

    after_align: bpy.props.EnumProperty(
        name="After Align",
        description="What the viewport shows when an alignment is done; End Side by Side and undo take it away again",
        items=(
            ("side_by_side", "Side by Side", "Copies of both meshes in one pose, with one pattern and matched points"),
            ("pattern", "Pattern", "Both meshes where they are, with one pattern"),
            ("nothing", "Nothing", "What it showed before"),
        ),
        default="side_by_side",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout = self.layout
        row = layout.row()
        row.label(text="In the 3D viewport: press N, tab Möbius", icon="INFO")
        row.operator("mobius.guide", icon="HELP")
        layout.use_property_split = True
        layout.prop(self, "time_limit")
        layout.prop(self, "check_while_drawing")
        layout.prop(self, "after_align")


def preferences(context: bpy.types.Context) -> MOBIUS_AP_preferences | None:
    """Return the settings, or None where the extension is registered without being an enabled add-on."""
    addon = context.preferences.addons.get(ROOT_PACKAGE)
    return addon.preferences if addon is not None else None


register, unregister = bpy.utils.register_classes_factory((MOBIUS_AP_preferences,))
