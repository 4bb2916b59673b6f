"""Runs in Blender's window, driven by `gui_shot.sh`: two meshes of over 100,000 faces, from the click to the verdict.

How long each step takes, how long the window stands still at most, and that ESC ends the work. `bpy`, `PACKAGE`,
`region`, `click` and `shot` are the driver's.
"""

import importlib
import time

import hand
from hand import Wait, click_on, escape, find, picture, until

vars(hand).update(region=region, click=click, shot=shot)
demo = importlib.import_module(PACKAGE + ".mobius_addon.demo")
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job

FACES = 100_000
"""Triangles that the demo's heads are brought to."""

SLOWEST = 1.5
"""Times the processor's work for drawing the window that it may take once 100,000 faces are chosen, by software."""


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    assert bpy.ops.mobius.load_example("EXEC_DEFAULT", True) == {"FINISHED"}
    settings = bpy.context.scene.mobius
    names = settings.source.name, settings.target.name
    source, target = (bpy.data.objects[name] for name in names)
    settings.source = settings.target = None
    for obj in (source, target):
        refine(obj)
        print(f"[clicks] {obj.name} has {len(obj.data.polygons):,} faces", flush=True)
    bpy.ops.ed.undo_push(message="large")
    yield 1.0
    without = drawn()
    settings.source, settings.target = source, target
    yield from until(lambda: drawn() < without * SLOWEST)
    yield from picture("large")

    align = yield from find("bpy.ops.mobius.align")
    yield from click_on(align)
    yield from until(lambda: Job.current is not None and Job.current.progress.fraction >= 0.1)
    start = time.perf_counter()
    escape()
    yield from until(lambda: Job.current is None, every=0.02)
    print(f"[clicks] ESC ends it after {time.perf_counter() - start:.2f} s", flush=True)
    assert not target.data.mobius_alignment.target_fingerprint

    yield from click_on(align)
    yield from finished("Align", lambda: bool(target.data.mobius_alignment.target_fingerprint), "large-searching")
    assert bpy.context.space_data.local_view is not None, "it is not shown side by side"
    yield from picture("large-side-by-side", 3.0)
    print(f"[clicks] drawing: {without:.2f} s before, {drawn():.2f} s side by side", flush=True)

    transfer = yield from find("bpy.ops.mobius.transfer", upwards=True)
    yield from click_on(transfer)
    yield from finished("Transfer", lambda: bool(target.data.mobius_transferred), "large-transferring")
    yield from picture("large-transferred", 3.0)
    print("[clicks] done", flush=True)


def refine(obj: bpy.types.Object) -> None:
    """Bring an object to so many triangles, with all that is on it but its shape keys."""
    bpy.context.view_layer.objects.active = obj
    if obj.data.shape_keys is not None:
        obj.shape_key_clear()
    finer = obj.modifiers.new("Finer", "SUBSURF")
    finer.subdivision_type, finer.levels = "SIMPLE", 2
    bpy.ops.object.modifier_apply(modifier=finer.name)
    coarser = obj.modifiers.new("Coarser", "DECIMATE")
    coarser.ratio = FACES / (2 * len(obj.data.polygons))
    bpy.ops.object.modifier_apply(modifier=coarser.name)


def finished(what: str, done: object, name: str) -> Wait:
    """Wait for a job to be done, take a picture in its middle, and say how long the window stood still at most."""
    start = last = time.perf_counter()
    still, taken, stages = 0.0, False, {}
    while not (done() and Job.current is None):
        yield 0.05
        now = time.perf_counter()
        stage = Job.current.progress.stage if Job.current is not None else "writing"
        still, last = max(still, now - last), now
        stages[stage] = max(stages.get(stage, 0.0), now - start)
        if not taken and Job.current is not None and Job.current.progress.fraction > 0.3:
            yield from picture(name, 0.1)
            taken, last = True, time.perf_counter()
        assert now - start < 400, f"{what} is not done: {stages}"
    print(f"[clicks] {what}: {time.perf_counter() - start:.1f} s, still for {still:.2f} s at most", flush=True)
    print(f"[clicks] stages end at { ({x: round(y, 1) for x, y in stages.items()}) }", flush=True)


def drawn() -> float:
    """Return how long the processor works to draw the window once."""
    start = time.process_time()
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=3)
    return (time.process_time() - start) / 3
