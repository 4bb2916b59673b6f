"""For whoever begins: two heads to try everything on, and the guide."""

# no postponed annotations here: Blender reads the properties from them
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from mathutils import Vector

from .. import viewport
from ..jobs import why_busy
from ..usable import why_not_mode

COLLECTION = "Example Heads"
"""Without "Mobius": who searches for an operator would find *Move to Collection > Mobius ...* first."""

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "guide.html"


class MOBIUS_OT_load_example(bpy.types.Operator):
    """Put two heads into the file, in a collection of their own, and choose them as source and target."""

    bl_idname = "mobius.load_example"
    bl_label = "Load Example"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in Object Mode where there is none yet."""
        reason = why_not_mode(context) or why_busy()
        if not reason and COLLECTION in context.scene.collection.children:
            reason = rpt_("The example is there already")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Build the heads, the target beside the source."""
        from ..demo import build_objects  # only who asks for it waits for its imports

        scene = context.scene
        source, target, _ = build_objects(scene)
        collection = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(collection)
        for obj in (source, target):
            scene.collection.objects.unlink(obj)
            collection.objects.link(obj)
        target.scale = (0.55,) * 3
        target.location = Vector((2.6, 0.4, 0)) - 0.55 * Vector(sum(map(Vector, target.bound_box), Vector()) / 8)
        context.view_layer.update()
        for obj in context.view_layer.objects:
            obj.select_set(obj in (source, target))
        context.view_layer.objects.active = source
        viewport.look_at_selected(context)
        scene.mobius.source, scene.mobius.target = source, target
        self.report({"INFO"}, rpt_("'{}' and '{}' are chosen: press Align").format(source.name, target.name))
        return {"FINISHED"}


class MOBIUS_OT_remove_example(bpy.types.Operator):
    """Remove the heads of the example, with all that was made of them."""

    bl_idname = "mobius.remove_example"
    bl_label = "Remove Example"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow in Object Mode where there is one."""
        reason = why_not_mode(context) or why_busy()
        if not reason and COLLECTION not in context.scene.collection.children:
            reason = rpt_("There is no example in this scene")
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the collection, its objects with the empties on them, and their meshes."""
        collection = context.scene.collection.children[COLLECTION]
        objects = {x for obj in collection.objects for x in (obj, *obj.children_recursive)}
        meshes = {obj.data for obj in objects if obj.type == "MESH"}
        for obj in objects:
            bpy.data.objects.remove(obj)
        for mesh in meshes:
            if not mesh.users:
                bpy.data.meshes.remove(mesh)
        bpy.data.collections.remove(collection)
        return {"FINISHED"}


class MOBIUS_OT_guide(bpy.types.Operator):
    """Open the guide, a page that comes with the extension, in the web browser."""

    bl_idname = "mobius.guide"
    bl_label = "Open Guide"
    bl_options = {"INTERNAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Open it."""
        if not GUIDE.is_file():
            self.report({"ERROR"}, rpt_("The guide '{}' is missing: install the extension again").format(GUIDE))
            return {"CANCELLED"}
        return bpy.ops.wm.url_open(url=GUIDE.as_uri())
