"""What a person does during Align: another workspace, mode, name, window. The result waits and is then written."""

import importlib
from typing import Any

import bpy
from hand import Wait, over_the_viewport, picture, pointer, turn_view, undo, until

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}
LONG = {"samples": 100, "targets": 2000, "reflect": "auto", "refine": "dense"}
"""Blender keeps what an operator was last called with: what is to be otherwise has to be said."""


def steps(package: str, names: tuple[str, str]) -> Wait:
    """Align the meshes of these names, the source's and the target's, three times, with something else in between."""
    jobs = importlib.import_module(package + ".mobius_addon.jobs")
    window = bpy.context.window

    def kept() -> tuple[Any, ...]:
        found = bpy.data.objects[names[1]].data.mobius_alignment
        return found.target_fingerprint, found.report

    bpy.context.view_layer.objects.active = bpy.data.objects[names[1]]
    home = window.workspace
    before = kept()
    yield from align(jobs, names, 61)
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

    yield from align(jobs, names, 62)
    bpy.ops.object.mode_set(mode="EDIT")
    yield from until(lambda: jobs.Job.current.waits)
    bpy.ops.object.mode_set(mode="OBJECT")
    yield from until(lambda: jobs.Job.current is None)
    yield 0.5
    assert kept() != before
    before = kept()

    yield from align(jobs, names, 63)
    bpy.data.objects[names[1]].name = "Renamed"
    yield from until(lambda: jobs.Job.current is None)
    yield 0.5
    bpy.data.objects["Renamed"].name = names[1]
    assert kept() != before, "a new name has made the alignment homeless"
    before = kept()

    yield from align(jobs, names, 64)
    bpy.ops.wm.window_new()
    other = next(x for x in bpy.context.window_manager.windows if x != window)
    yield from until(lambda: jobs.Job.current is None)
    with bpy.context.temp_override(window=other):
        bpy.ops.wm.window_close()
    yield 1.0
    assert kept() != before, "another window was in the way"
    assert jobs.Job.refused is None
    yield from deleted(jobs, names)
    print("[clicks] results waited for Object Mode and were then written", flush=True)


def deleted(jobs: Any, names: tuple[str, str]) -> Wait:
    """Delete the target by X during Align: it is said, and no popup takes the Ctrl Z that brings the target back."""
    source, target = (bpy.data.objects[name] for name in names)
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == target)
    bpy.context.view_layer.objects.active = target
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = source, target
    bpy.ops.ed.undo_push(message="before it is deleted")
    before = everything()
    yield from align(jobs, names, 150, LONG)
    over_the_viewport()
    yield 0.5
    pointer("key", "x")
    yield 1.0
    pointer("key", "Return")
    yield from until(lambda: names[1] not in bpy.context.view_layer.objects)
    assert jobs.Job.current is not None, "it was deleted too late"
    yield from until(lambda: jobs.Job.current is None)
    assert "was removed" in jobs.Job.refused.why
    yield from picture("deleted-meanwhile")
    undo()
    yield from until(lambda: names[1] in bpy.context.view_layer.objects)
    yield 0.5
    assert everything() == before
    assert jobs.Job.refused is None, "the panel speaks of what is undone"


def align(jobs: Any, names: tuple[str, str], samples: int, how: dict[str, Any] = QUICK) -> Wait:
    """Begin to align the meshes of these names, with so many samples that the result is not known yet."""
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = (bpy.data.objects[name] for name in names)
    bpy.ops.mobius.align("INVOKE_DEFAULT", True, **how | {"samples": samples})
    yield from until(lambda: jobs.Job.current is not None)


def everything() -> tuple[Any, ...]:
    """What is chosen, what there is, and what is on the meshes."""
    settings = bpy.context.scene.mobius
    chosen = tuple(obj and obj.name for obj in (settings.source, settings.target, bpy.context.object))
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    return (
        chosen,
        sorted(obj.name for obj in bpy.context.selected_objects),
        sorted((obj.name, obj.data.name, len(obj.data.vertices), obj.data.mobius_alignment.report) for obj in meshes),
        sorted((obj.name, x.name) for obj in meshes for x in obj.data.attributes if not x.name.startswith(".")),
    )
