"""Runs in Blender's window, driven by `gui_shot.sh`: what a person does with the installed extension, by real clicks.

Two scans are chosen in the pickers, aligned, stopped with ESC, aligned again, looked at, transferred and undone, and
every step is checked. Where a button is, the script finds out as a person could: it moves the mouse down the sidebar
and presses Ctrl C, with which Blender copies the command of the button under the mouse.

`bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib
import json
import time
from typing import Any

import hand
import meanwhile
import redoing
import showing
from hand import Wait, choose, click_on, escape, find, picture, redo, undo, until
from mathutils import Euler, Vector

vars(hand).update(region=region, click=click, shot=shot)
demo = importlib.import_module(PACKAGE + ".mobius_addon.demo")
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    source, target = set_the_scene()
    # what is shown after Align has its own steps
    bpy.context.preferences.addons[PACKAGE].preferences.after_align = "nothing"
    yield 1.0
    before = state(source), state(target)

    yield from choose("source", source)
    yield from choose("target", target)
    settings = bpy.context.scene.mobius
    assert (settings.source, settings.target) == (source, target), "the pickers were not used"
    yield from picture("chosen")

    align = yield from find("bpy.ops.mobius.align")
    for share in (0.1, 0.3, 0.6):
        yield from click_on(align)
        yield from until(lambda share=share: Job.current is not None and Job.current.progress.fraction >= share)
        assert (state(source), state(target)) == before
        stage, start = Job.current.progress.stage, time.perf_counter()
        escape()
        yield from until(lambda: Job.current is None, every=0.02)
        spent = time.perf_counter() - start
        idle = yield from idle_round()
        print(f"[clicks] ESC while '{stage}': over after {spent:.2f} s; idle rounds take {idle:.2f} s", flush=True)
        assert (state(source), state(target)) == before, "a stopped alignment has changed something"
        yield 0.3

    yield from click_on(align)
    yield from until(lambda: Job.current is not None)
    yield from until(lambda: Job.current is None or Job.current.progress.value)
    yield from picture("searching", 0.1)
    yield from until(lambda: Job.current is None)
    yield 0.5
    found = json.loads(target.data.mobius_alignment.report)
    assert found["certified"], found
    assert "Mobius" in source.data.uv_layers
    assert "Mobius" in target.data.uv_layers
    aligned = state(source), state(target)
    yield from picture("aligned")

    transfer = yield from find("bpy.ops.mobius.transfer", upwards=True)
    yield from click_on(transfer)
    yield from until(lambda: Job.current is None and state(target) != aligned[1])
    assert {group.name for group in source.vertex_groups} <= {group.name for group in target.vertex_groups}
    assert target.data.shape_keys.key_blocks.keys() == source.data.shape_keys.key_blocks.keys()
    yield from picture("transferred")
    names = source.name, target.name
    for expected in (aligned, before):
        undo()
        yield 1.0
        # undo has made the objects anew
        assert tuple(state(bpy.data.objects[name]) for name in names) == expected, "one undo takes back one step"
    redo()
    yield 1.0
    redo()
    yield 1.0
    assert state(bpy.data.objects[names[1]])["keys"], "redo brings the transfer back"

    yield from redoing.steps(PACKAGE, names)
    yield from meanwhile.steps(PACKAGE, names)
    yield from showing.steps(PACKAGE, names)

    view = bpy.context.window_manager.mobius_view
    look = bpy.context.space_data.shading.type, bpy.context.space_data.shading.color_type
    view.matches = True
    yield from picture("matches")
    view.matches = False
    for measure in ("confidence", "dilatation", "factor"):
        bpy.ops.mobius.heat_map("EXEC_DEFAULT", True, measure=measure)
        yield from picture(f"heat-map-{measure}")
    bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    yield from picture("side-by-side")
    assert bpy.context.space_data.local_view is not None
    bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
    yield 0.5
    assert bpy.context.space_data.local_view is None
    view.matches, view.lines = True, 0.3
    bpy.ops.mobius.show_discs()
    bpy.context.space_data.show_region_ui = False  # what is left of the viewport is narrow
    yield 1.0
    bpy.ops.view3d.view_all()
    yield from picture("discs")
    bpy.context.space_data.show_region_ui = True
    bpy.context.preferences.view.language = "de_DE"
    yield 1.0
    yield from picture("german")
    assert region("UI").width > 1, "the panel is not to be seen"
    bpy.context.preferences.view.language = "en_US"
    yield 0.5

    shading = bpy.context.space_data.shading
    bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    yield 0.5
    bpy.ops.mobius.clear("EXEC_DEFAULT", True)
    yield from picture("cleared")
    assert bpy.context.space_data.local_view is None
    assert (shading.type, shading.color_type) == look, "the viewport looks otherwise than before"
    assert [view.matches, view.discs, view.legend] == [False] * 3
    for name in names:
        found = state(bpy.data.objects[name])
        assert not found["aligned"]
        assert not [x for x in (*found["groups"], *(x[0] for x in found["attributes"])) if "Mobius" in x]

    # another file in the middle of the work
    bpy.ops.mobius.align("INVOKE_DEFAULT", samples=99)  # what was asked before is known
    yield from until(lambda: Job.current is not None and Job.current.progress.fraction >= 0.3)
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield 1.0
    assert Job.current is None, "the work goes on after its file was closed"
    assert not bpy.context.window_manager.mobius_view.discs
    yield from showing.opened(PACKAGE, names)
    print("[clicks] done", flush=True)


def set_the_scene() -> tuple[Any, Any]:
    """Put the demo's two scans beside each other and look at their faces."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    source, target, _ = demo.build_objects(bpy.context.scene)
    for obj in (source, target):
        obj.name = obj.name.title()
    right = Vector((1, 0.15, 0))
    target.scale = (0.55,) * 3
    target.location = right * 2.6 - 0.55 * Vector(sum(map(Vector, target.bound_box), Vector()) / 8)
    bpy.context.view_layer.update()
    bpy.context.space_data.region_3d.view_rotation = Euler((1.3, 0, 0.15)).to_quaternion()
    bpy.ops.view3d.view_all()
    bpy.ops.ed.undo_push(message="scene")
    return source, target


def state(obj: Any) -> dict[str, Any]:
    """What an operator could have changed."""
    mesh = obj.data
    return {
        "attributes": sorted((x.name, x.data_type, x.domain) for x in mesh.attributes if not x.name.startswith(".")),
        "groups": [group.name for group in obj.vertex_groups],
        "keys": [] if mesh.shape_keys is None else mesh.shape_keys.key_blocks.keys(),
        "aligned": mesh.mobius_alignment.target_fingerprint,
        "materials": len(mesh.materials),
    }


def idle_round() -> Any:
    """Return how long the window takes to draw itself and look at its events when nothing is to be done."""
    start = time.perf_counter()
    yield 0.02
    yield 0.02
    return (time.perf_counter() - start) / 2
