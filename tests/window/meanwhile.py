"""What a person does during Align: another workspace, mode, name, window. The result waits and is then written."""

import importlib
from typing import Any

import bpy
from hand import Wait, picture, turn_view, until

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}


def steps(package: str, names: tuple[str, str]) -> Wait:
    """Align the meshes of these names, the source's and the target's, three times, with something else in between."""
    jobs = importlib.import_module(package + ".mobius_addon.jobs")
    window = bpy.context.window

    def kept() -> tuple[Any, ...]:
        found = bpy.data.objects[names[1]].data.mobius_alignment
        return found.target_fingerprint, found.report

    def begin(samples: int) -> Wait:
        bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = (bpy.data.objects[name] for name in names)
        bpy.ops.mobius.align("INVOKE_DEFAULT", True, **QUICK | {"samples": samples})
        yield from until(lambda: jobs.Job.current is not None)

    bpy.context.view_layer.objects.active = bpy.data.objects[names[1]]
    home = window.workspace
    before = kept()
    yield from begin(61)
    window.workspace = bpy.data.workspaces["Sculpting"]  # which goes to Sculpt Mode
    yield 1.0
    assert bpy.context.mode == "SCULPT"
    yield from until(lambda: jobs.Job.current.waits)
    yield from picture("waiting")
    yield from turn_view()
    assert kept() == before, "an alignment was written in Sculpt Mode"
    window.workspace = home
    yield from until(lambda: jobs.Job.current is None)
    yield 0.5
    assert bpy.context.mode == "OBJECT"
    assert kept() != before, "the alignment that had to wait is lost"
    yield from picture("written-after-waiting")
    bpy.ops.ed.undo()
    yield 1.0
    assert kept() == before, "one undo takes back what was written late"

    yield from begin(62)
    bpy.ops.object.mode_set(mode="EDIT")
    yield from until(lambda: jobs.Job.current.waits)
    bpy.ops.object.mode_set(mode="OBJECT")
    yield from until(lambda: jobs.Job.current is None)
    yield 0.5
    assert kept() != before
    before = kept()

    yield from begin(63)
    bpy.data.objects[names[1]].name = "Renamed"
    yield from until(lambda: jobs.Job.current is None)
    yield 0.5
    bpy.data.objects["Renamed"].name = names[1]
    assert kept() != before, "a new name has made the alignment homeless"
    before = kept()

    yield from begin(64)
    bpy.ops.wm.window_new()
    other = next(x for x in bpy.context.window_manager.windows if x != window)
    yield from until(lambda: jobs.Job.current is None)
    with bpy.context.temp_override(window=other):
        bpy.ops.wm.window_close()
    yield 1.0
    assert kept() != before, "another window was in the way"
    print("[clicks] results waited for Object Mode and were then written", flush=True)
