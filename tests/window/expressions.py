"""Runs in Blender's window, driven by `gui_shot.sh`: a person's expressions, carried to another head and tried there.

The heads are those of `MOBIUS_DATA`. `bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib
import os
import time
from pathlib import Path
from typing import Any

import hand
import numpy as np
from hand import Wait, click_on, escape, find, picture, pointer, redo, turn_view, undo, until
from mathutils import Euler

vars(hand).update(region=region, click=click, shot=shot)
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job
playing = importlib.import_module(PACKAGE + ".mobius_addon.playing")
Play, strength_at = playing.Play, playing.strength_at
panels = importlib.import_module(PACKAGE + ".mobius_addon.panel")

STRONG = 0.6
"""Of an expression's full strength, at which a picture is taken."""

HEADS = Path(os.environ["MOBIUS_DATA"]) / "heads"


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    source, target = head("mpfb_woman", "Woman", keys=True), head("mpfb_man", "Man", keys=False)
    target.location.x = 1.3 * source.dimensions.x
    names = source.name, target.name
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    bpy.context.view_layer.update()
    bpy.context.space_data.region_3d.view_rotation = Euler((1.5, 0, 0.15)).to_quaternion()
    bpy.ops.view3d.view_all()
    bpy.ops.ed.undo_push(message="heads")
    yield 1.0
    yield from click_on((yield from find("bpy.ops.mobius.align")))
    yield from until(lambda: Job.current is None and bool(target.data.mobius_alignment.target_fingerprint))
    yield from picture("expressions-aligned", 3.0)
    yield from click_on((yield from find("bpy.ops.mobius.transfer", upwards=True)))
    yield from until(lambda: Job.current is None and target.data.shape_keys is not None)
    for folded in (panels.MOBIUS_PT_proof, panels.MOBIUS_PT_notes, panels.MOBIUS_PT_parts, panels.MOBIUS_PT_pairs):
        bpy.utils.unregister_class(folded)  # so that the sidebar need not be scrolled
    yield 2.0
    keys = target.data.shape_keys.key_blocks
    keys[3].value = 0.25  # of the person's own
    before = values(names)

    button = yield from find("bpy.ops.mobius.try_expressions")
    yield from click_on(button)
    yield from until(lambda: Play.current is not None)
    for number, name in enumerate(("browInnerUp", "jawOpen")):
        yield from go_to(name)
        shown = [values(names)[one, name] for one in names]
        print(f"[clicks] {name}: {shown}", flush=True)
        assert shown[0] == shown[1] > STRONG, "the source does not go along"
        yield from picture(f"expressions-{number}", 0.05)
    yield from turn_view()
    assert Play.current is not None, "turning the view has ended it"
    escape()
    yield from until(lambda: Play.current is None)
    assert values(names) == before, "the sliders are not as they were"
    yield from picture("expressions-ended")

    yield from click_on(button)
    yield from until(lambda: Play.current is not None)
    yield 1.0
    undo()  # ends it, and takes back the transfer
    yield from until(lambda: bpy.data.objects[names[1]].data.shape_keys is None)
    assert Play.current is None
    redo()
    yield from until(lambda: bpy.data.objects[names[1]].data.shape_keys is not None)
    assert set(values(names)) == set(before)
    print("[clicks] done", flush=True)


def go_to(name: str) -> Wait:
    """Go to an expression with the arrows, and wait until it is strong."""
    wanted = next(number for number, (own, _) in enumerate(Play.current.names) if own == name)
    end = time.monotonic() + 120
    while not (Play.current.number == wanted and strength_at(Play.current.place - wanted) > STRONG):
        assert time.monotonic() < end, f"{name} was not to be seen"
        if (now := Play.current.number) != wanted:
            pointer("key", "Right" if now < wanted else "Left")
            yield from until(lambda now=now: Play.current is None or Play.current.number != now, 0.02)
        else:
            yield 0.02


def values(names: tuple[str, str]) -> dict[tuple[str, str], float]:
    """Return all sliders."""
    keys = {name: bpy.data.objects[name].data.shape_keys for name in names}
    return {(name, key.name): key.value for name, own in keys.items() for key in own.key_blocks}


def head(file: str, name: str, *, keys: bool) -> Any:
    """Make an object of a head, with its expressions or without."""
    stored = np.load(HEADS / f"{file}.npz")
    ends = np.cumsum(stored["sides"])[:-1]
    mesh = bpy.data.meshes.new(name)
    upright = stored["vertices"][:, [0, 2, 1]] * (1, -1, 1)
    mesh.from_pydata(upright.tolist(), [], [x.tolist() for x in np.split(stored["corner"], ends)])
    mesh.shade_smooth()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    if keys:
        obj.shape_key_add(name="Basis")
        for k, own in enumerate(stored["key_names"]):
            rows = slice(*stored["key_start"][k : k + 2])
            moved = upright.copy()
            moved[stored["key_vertex"][rows]] += stored["key_offset"][rows][:, [0, 2, 1]] * (1, -1, 1)
            key = obj.shape_key_add(name=str(own), from_mix=False)
            key.value = 0  # Blender 5 begins with 1
            key.data.foreach_set("co", moved.ravel().astype(np.float32))
    return obj
