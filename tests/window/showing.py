"""What is shown after Align without being asked, and that undo, redo, ending and deleting give the view back."""

import importlib
from typing import Any

import bpy
from hand import Wait, picture, until

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}


def steps(package: str, names: tuple[str, str]) -> Wait:
    """Align the meshes of these names, the source's and the target's, and look at the result."""
    jobs = importlib.import_module(package + ".mobius_addon.jobs")
    preferences = bpy.context.preferences.addons[package].preferences
    preferences.after_align = "side_by_side"
    objects = [bpy.data.objects[name] for name in names]
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == objects[0])
    bpy.context.view_layer.objects.active = objects[0]
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = objects
    bpy.ops.ed.undo_push(message="before it is shown")
    before = looks()

    bpy.ops.mobius.align("INVOKE_DEFAULT", True, **QUICK | {"samples": 65})
    yield from until(lambda: jobs.Job.current is not None)
    yield from until(lambda: jobs.Job.current is None)
    yield from until(is_alone)
    assert bpy.context.window_manager.mobius_view.matches
    for _ in range(4):  # new panels unfold step by step
        yield 0.5
    yield from picture("shown")
    bpy.ops.ed.undo()
    yield from until(lambda: looks() == before)
    bpy.ops.ed.redo()
    yield from until(is_alone)
    bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
    yield from until(lambda: looks() == before)
    assert bpy.context.selected_objects == [bpy.data.objects[names[0]]]
    for role in (1, 0):
        bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
        yield from until(is_alone)
        for number, obj in enumerate(sorted(bpy.context.selected_objects, key=lambda obj: obj.name)):
            obj.select_set(number == role)
        bpy.ops.object.delete()
        yield from until(lambda: looks() == before)
    preferences.after_align = "nothing"
    print("[clicks] the view was given back every time", flush=True)


def is_alone() -> bool:
    return bpy.context.space_data.local_view is not None


def looks() -> tuple[Any, ...]:
    """How the viewport shows things, and from where."""
    space = bpy.context.space_data
    view, shading = space.region_3d, space.shading
    place = [round(x, 3) for x in (*view.view_location, *view.view_rotation, view.view_distance)]
    return shading.type, shading.color_type, space.local_view is not None, place
