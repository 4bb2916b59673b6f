"""What is there to begin with: the demo's two heads beside each other, aligned, with panels folded away."""

import importlib
from typing import Any

import bpy
from mathutils import Euler, Vector


def aligned_heads(package: str) -> tuple[Any, Any]:
    """Return the source and the target, alone in the file; the sidebar need not be scrolled."""
    demo = importlib.import_module(package + ".mobius_addon.demo")
    panels = importlib.import_module(package + ".mobius_addon.panel")
    for kind in (bpy.data.objects, bpy.data.meshes):
        for one in list(kind):
            kind.remove(one)
    source, target, _ = demo.build_objects(bpy.context.scene)
    target.scale = (0.55,) * 3
    target.location = Vector((2.6, 0.4, 0)) - 0.55 * Vector(sum(map(Vector, target.bound_box), Vector()) / 8)
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    bpy.context.view_layer.update()
    bpy.context.space_data.region_3d.view_rotation = Euler((1.3, 0, 0.15)).to_quaternion()
    bpy.ops.view3d.view_all()
    assert bpy.ops.mobius.align("EXEC_DEFAULT", True) == {"FINISHED"}
    for folded in (panels.MOBIUS_PT_pictures, panels.MOBIUS_PT_transfer):
        bpy.utils.unregister_class(folded)
    return source, target
