"""Runs in Blender's window, driven by `gui_shot.sh`: textures, previewed, stopped half way, carried and undone.

As in `clicks.py` the buttons are found and clicked on by a real mouse; `bpy`, `PACKAGE`, `region`, `click` and `shot`
are the driver's.
"""

import importlib
import time
from typing import Any

import hand
import numpy as np
from hand import Wait, click_on, escape, find, picture, redo, undo, until
from mathutils import Euler, Vector

vars(hand).update(region=region, click=click, shot=shot)
demo = importlib.import_module(PACKAGE + ".mobius_addon.demo")
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    names = set_the_scene()
    yield 1.0
    settings = bpy.context.scene.mobius
    settings.source, settings.target = (bpy.data.objects[name] for name in names)
    settings.kinds = {"TEXTURES"}
    assert bpy.ops.mobius.align("EXEC_DEFAULT", True, **QUICK) == {"FINISHED"}
    yield 1.0
    before = state(names)

    assert bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True) == {"FINISHED"}
    yield from compiled()
    yield from picture("textures-preview")
    assert state(names)["target"] == before["target"], "a preview has changed the target"
    assert bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True) == {"FINISHED"}
    yield 0.5
    assert state(names) == before, "the end of a preview leaves something behind"

    settings.texture_size = 8192  # takes a while, so that there is something to stop
    transfer = yield from find("bpy.ops.mobius.transfer", upwards=True)
    for share in (0.15, 0.5):
        yield from click_on(transfer)
        yield from until(lambda share=share: Job.current is not None and Job.current.progress.fraction >= share, 0.02)
        assert Job.current is not None
        stage, reached = Job.current.progress.stage, Job.current.progress.fraction
        yield from picture(f"textures-at-{round(100 * share)}", 0.1)
        start = time.perf_counter()
        escape()
        yield from until(lambda: Job.current is None, every=0.02)
        spent = time.perf_counter() - start
        print(f"[clicks] ESC while '{stage}' at {reached:.0%}: over after {spent:.2f} s", flush=True)
        assert state(names) == before, "textures that were stopped have changed something"
        yield 0.3

    settings.texture_size = 1024
    yield from click_on(transfer)
    yield from until(lambda: Job.current is None and state(names) != before)
    bpy.context.space_data.shading.type = "MATERIAL"
    yield from compiled()
    yield from picture("textures-transferred")
    after = state(names)
    assert after["images"] == before["images"] + 1
    made = bpy.data.objects[names[1]].material_slots[0].material
    image = next(x.image for x in made.node_tree.nodes if x.type == "TEX_IMAGE")
    assert tuple(image.size) == (1024, 1024)
    undo()
    yield 1.0
    assert state(names) == before, "one undo takes back the textures"
    redo()
    yield 1.0
    assert state(names) == after, "redo brings them back"
    print("[clicks] done", flush=True)


def compiled() -> Wait:
    """Wait for the engine that draws materials: it compiles its shaders first, and shows them when drawn again."""
    for _ in range(30):
        region("WINDOW").tag_redraw()
        yield 1.0


def set_the_scene() -> tuple[str, str]:
    """Put the demo's two scans beside each other, the source with a picture, both unwrapped."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    source, target, _ = demo.build_objects(bpy.context.scene)
    for obj in (source, target):
        obj.name = obj.name.title()
        for layer in list(obj.data.uv_layers):
            obj.data.uv_layers.remove(layer)
        for other in bpy.context.scene.objects:
            other.select_set(other == obj)
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(angle_limit=np.radians(66), island_margin=0.01)
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.data.materials.clear()
    image = bpy.data.images.new("Skin", 2048, 2048)
    image.generated_type = "COLOR_GRID"
    image.pack()
    made: Any = bpy.data.materials.new("Skin")
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    shader = next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED")
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    source.data.materials.append(made)
    right = Vector((1, 0.15, 0))
    target.scale = (0.55,) * 3
    target.location = right * 2.6 - 0.55 * Vector(sum(map(Vector, target.bound_box), Vector()) / 8)
    bpy.context.view_layer.update()
    bpy.context.space_data.region_3d.view_rotation = Euler((1.3, 0, 0.15)).to_quaternion()
    bpy.ops.view3d.view_all()
    bpy.ops.ed.undo_push(message="scene")
    return source.name, target.name


def state(names: tuple[str, str]) -> dict[str, Any]:
    """What textures could have changed."""
    mesh = bpy.data.objects[names[1]].data
    return {
        "target": ([x.name for x in mesh.uv_layers], [x.name for x in mesh.materials if x is not None]),
        "materials": len(bpy.data.materials),
        "images": len([x for x in bpy.data.images if x.type == "IMAGE"]),
        "meshes": len(bpy.data.meshes),
    }
