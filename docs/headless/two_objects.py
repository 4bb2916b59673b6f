"""Match two objects of a scene and carry over what is on the first, in Blender without its window.

    blender --background --python-exit-code 1 --python docs/headless/two_objects.py -- OUT.blend

With Blender's Python module, after `install.py`:

    python docs/headless/two_objects.py OUT.blend
"""

import math
import sys
from pathlib import Path

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils


def landscape(name: str, cells: int) -> bpy.types.Object:
    """The same hills for any number of cells: what two scans of one thing are."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=2)
    obj = bpy.context.object
    obj.name = name
    for vertex in obj.data.vertices:
        x, y, _ = vertex.co
        hill = 0.4 * math.exp(-8 * ((x - 0.4) ** 2 + (y - 0.3) ** 2))
        vertex.co.z = hill - 0.3 * math.exp(-6 * ((x + 0.5) ** 2 + y**2))
    return obj


bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)  # without the cube

# Blender's module starts without the extensions that are enabled in the person's Blender
if not hasattr(bpy.context.scene, "mobius"):
    addon_utils.enable("bl_ext.user_default.mobius", default_set=True)

source, target = landscape("Source", 40), landscape("Target", 31)
target.rotation_euler, target.scale, target.location = (0.3, 1.0, 2.0), (1.5, 1.5, 1.5), (4, 0, 0)
hill = source.vertex_groups.new(name="Hill")
for vertex in source.data.vertices:
    hill.add([vertex.index], max(vertex.co.z, 0) / 0.4, "REPLACE")

scene = bpy.context.scene.mobius
scene.source, scene.target = source, target
bpy.ops.mobius.align()  # raises RuntimeError with the reason where the two cannot be aligned
bpy.ops.mobius.transfer(kinds={"VERTEX_GROUPS", "UV"})

found = target.data.mobius_alignment
print(f"matched {found.value:.2f} of at most {found.upper_bound:.2f}, certified: {found.certified}")
print(f"on the target: {target.vertex_groups.keys()}, {target.data.uv_layers.keys()}")

out = sys.argv[-1] if sys.argv[-1].endswith(".blend") else "two_objects.blend"
bpy.ops.wm.save_as_mainfile(filepath=str(Path(out).resolve()))
