"""What is shown after Align without being asked, and that undo, redo, ending and deleting give the view back."""

import importlib
import shutil
from typing import Any

import bpy
import redoing
from hand import SHOTS, Wait, over_the_viewport, picture, pointer, until

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}
SAVED = SHOTS / "saved.blend"


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
    yield from saved_while_shown(names)
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


def saved_while_shown(names: tuple[str, str]) -> Wait:
    """Save the file with Ctrl S: the window stays as it is, and the file has nothing of it."""
    bpy.ops.wm.save_as_mainfile(filepath=str(SAVED))
    SAVED.unlink()
    there = looks(), {obj.name for obj in bpy.context.selected_objects}, bpy.context.object.name
    alone = {obj.name for obj in bpy.context.visible_objects}
    over_the_viewport()
    pointer("key", "ctrl+s")
    yield from until(SAVED.exists)
    yield 1.0
    assert (looks(), {obj.name for obj in bpy.context.selected_objects}, bpy.context.object.name) == there
    assert {obj.name for obj in bpy.context.visible_objects} == alone
    assert not bpy.data.is_dirty
    other = SAVED.with_name("copied.blend")  # Blender 5 does not look into the file that is open
    shutil.copyfile(SAVED, other)
    with bpy.data.libraries.load(str(other)) as (held, _):
        assert not [name for name in held.objects if "side by side" in name], held.objects
        assert set(names) <= set(held.objects)
    other.unlink()


def opened(package: str, names: tuple[str, str]) -> Wait:
    """Open the file that was saved meanwhile: it shows everything and what was selected, and its result still holds."""
    stored = importlib.import_module(package + ".mobius_addon.stored_alignment")
    bpy.ops.wm.open_mainfile(filepath=str(SAVED))
    yield 1.0
    assert not is_alone()
    assert [obj.name for obj in bpy.context.selected_objects] == [names[0]]
    assert set(names) <= {obj.name for obj in bpy.context.visible_objects}
    assert bpy.context.space_data.shading.color_type != "VERTEX"
    SAVED.unlink()
    source, target = (bpy.data.objects[name] for name in names)
    assert stored.exists(target, source)
    assert stored.why_stale(target, source) is None
    yield from picture("reopened")
    bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    yield from until(is_alone)
    bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
    yield from until(lambda: not is_alone())
    yield from redoing.after_opening(package, names)


def is_alone() -> bool:
    return bpy.context.space_data.local_view is not None


def looks() -> tuple[Any, ...]:
    """How the viewport shows things, and from where."""
    space = bpy.context.space_data
    view, shading = space.region_3d, space.shading
    place = [round(x, 3) for x in (*view.view_location, *view.view_rotation, view.view_distance)]
    return shading.type, shading.color_type, space.local_view is not None, place
