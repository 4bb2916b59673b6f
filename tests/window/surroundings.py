"""Runs in Blender's window, driven by `gui_shot.sh`: the panel where work is done otherwise than in a fresh window.

Another theme, scale and width, another mode, a second window, a linked mesh, one that cannot be used, and
the search for commands. `bpy`, `PACKAGE`, `region`, `click`, `drag` and `shot` are the driver's.
"""

import importlib
from pathlib import Path
from typing import Any

import hand
from hand import SHOTS, Wait, click_on, find, over_the_viewport, picture, pointer, screen_height, undo, until

vars(hand).update(region=region, click=click, shot=shot)
demo = importlib.import_module(PACKAGE + ".mobius_addon.demo")
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job
stored_alignment = importlib.import_module(PACKAGE + ".mobius_addon.stored_alignment")
comparison = importlib.import_module(PACKAGE + ".mobius_addon.comparison")

QUICK = {"samples": 60, "targets": 300, "reflect": "never", "refine": "mobius"}


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    yield from example()
    settings = bpy.context.scene.mobius
    names = settings.source.name, settings.target.name
    yield from searched(names)
    assert bpy.ops.mobius.align("EXEC_DEFAULT", True, **QUICK) == {"FINISHED"}
    bpy.ops.mobius.heat_map("EXEC_DEFAULT", True, measure="confidence")
    yield from own_local_view(names)
    yield from second_window(names)
    yield from mended(names)
    yield from linked(names)
    yield from modes(names)
    yield from looks(names)
    print("[clicks] done", flush=True)


def example() -> Wait:
    """Load the example by its button, which then stands where Remove Example is."""
    yield 1.0
    yield from click_on((yield from find("bpy.ops.mobius.load_example", across=0.75)))
    yield from until(lambda: bpy.context.scene.mobius.target is not None)
    yield from picture("example")


def searched(names: tuple[str, str]) -> Wait:
    """Search for "map mobius", as F3 does, and run what is found; a collection may be called Mobius too."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name in names)
    source, target = (bpy.data.objects[name] for name in names)
    bpy.context.view_layer.objects.active = source
    for name, value in QUICK.items():
        setattr(bpy.context.scene.mobius, name, value)
    bpy.context.preferences.addons[PACKAGE].preferences.after_align = "nothing"
    over_the_viewport()
    yield 0.5
    bpy.ops.wm.search_menu("INVOKE_DEFAULT")
    yield 2.0
    pointer("type", "--delay", "60", "map mobius")
    yield from picture("search", 3.0)
    pointer("key", "Return")
    yield from until(lambda: Job.current is None and bool(target.data.mobius_transferred))
    yield 1.0


def looks(names: tuple[str, str]) -> Wait:
    """Blender's light theme, a scale of 1.5, German, and a sidebar as narrow as it can be."""
    bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    bpy.context.window_manager.mobius_view.matches = True
    preferences = bpy.context.preferences
    themes = Path(bpy.utils.preset_paths("interface_theme")[0])
    bpy.ops.script.execute_preset(
        filepath=str(themes / "Blender_Light.xml"), menu_idname="USERPREF_MT_interface_theme_presets"
    )
    yield from picture("light")
    bpy.ops.preferences.reset_default_theme()
    preferences.view.ui_scale = 1.5
    yield 1.0
    yield from picture("large-scale")
    preferences.view.language = "de_DE"
    yield from picture("large-scale-german")
    preferences.view.ui_scale = 1.0
    yield 1.0
    sidebar = region("UI")
    before = sidebar.width
    for beside in 3 * (-3, 8, 3, 0, -6):  # where its edge can be gripped differs between versions
        left, y = sidebar.x + beside, screen_height() - (sidebar.y + sidebar.height - 60)
        yield drag(left, y, left + 90, y)
        yield 1.0
        if region("UI").width != before:
            break
    print(f"[clicks] sidebar {before} -> {region('UI').width} pixels wide", flush=True)
    assert 1 < region("UI").width < before
    over_the_viewport()
    yield from picture("narrow-german")
    preferences.view.language = "en_US"
    yield from picture("narrow")
    bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
    yield 0.5


def modes(names: tuple[str, str]) -> Wait:
    """In other modes the buttons say what to do instead of failing."""
    source = bpy.data.objects[names[0]]
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == source)
    bpy.context.view_layer.objects.active = source
    for mode in ("WEIGHT_PAINT", "SCULPT"):
        bpy.ops.object.mode_set(mode=mode)
        yield from picture(mode.lower().replace("_", "-"))
        for operator in (bpy.ops.mobius.align, bpy.ops.mobius.transfer, bpy.ops.mobius.side_by_side):
            assert not operator.poll(), operator
        bpy.ops.object.mode_set(mode="OBJECT")
        assert bpy.ops.mobius.align.poll()


def own_local_view(names: tuple[str, str]) -> Wait:
    """A person's local view is there again when Side by Side ends, also if the file was saved meanwhile."""
    source = bpy.data.objects[names[0]]
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == source)
    area = max((x for x in bpy.context.screen.areas if x.type == "VIEW_3D"), key=lambda x: x.width)
    space, whole = area.spaces.active, next(x for x in area.regions if x.type == "WINDOW")

    def seen() -> set[str]:
        drawn = bpy.context.evaluated_depsgraph_get()  # Blender 4.3 knows it of these
        objects = bpy.context.view_layer.objects
        return {obj.name for obj in objects if obj.evaluated_get(drawn).visible_in_viewport_get(space)}

    with bpy.context.temp_override(area=area, region=whole):
        bpy.ops.view3d.localview(frame_selected=False)
        yield 0.5
        assert seen() == {source.name}, seen()
        bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    yield 0.5
    path = SHOTS / "own-local-view.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    path.unlink()
    assert len(seen()) == 2, seen()
    assert source.name not in seen()
    with bpy.context.temp_override(area=area, region=whole):
        bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
        yield 0.5
        assert space.local_view is not None
        assert seen() == {names[0]}, seen()
        bpy.ops.view3d.localview(frame_selected=False)
    yield 0.5


def second_window(names: tuple[str, str]) -> Wait:
    """Side by Side in one window leaves the other window's viewport alone, and goes when it is ended in the other."""
    window = bpy.context.window
    bpy.ops.wm.window_new_main()
    other = next(x for x in bpy.context.window_manager.windows if x != window)
    yield 1.0
    spaces = [max((a for a in x.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width) for x in (window, other)]
    with bpy.context.temp_override(window=window, area=spaces[0]):
        bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True)
    yield 0.5
    assert [area.spaces.active.local_view is not None for area in spaces] == [True, False]
    path = SHOTS / "two-windows.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    path.unlink()
    assert [area.spaces.active.local_view is not None for area in spaces] == [True, False]
    yield from picture("two-windows")
    with bpy.context.temp_override(window=other, area=spaces[1]):
        bpy.ops.mobius.end_side_by_side("EXEC_DEFAULT", True)
    yield 0.5
    assert [area.spaces.active.local_view is not None for area in spaces] == [False, False]
    assert not comparison.is_shown(bpy.context)
    with bpy.context.temp_override(window=other):
        bpy.ops.wm.window_close()
    yield 1.0


def mended(names: tuple[str, str]) -> Wait:
    """A mesh that cannot be used says why, and a button beside it mends it."""
    settings = bpy.context.scene.mobius
    settings.largest_part = False
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, location=(0, 0, 3))
    balls = bpy.context.object
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(3, 0, 3))
    balls.select_set(True)
    bpy.context.view_layer.objects.active = balls
    bpy.ops.object.join()
    name, before = balls.name, len(balls.data.vertices)
    settings.target = balls
    bpy.ops.ed.undo_push(message="two parts")
    yield from picture("in-the-way")
    place = yield from find("bpy.ops.mobius.mend")
    yield from click_on(place)
    yield from until(lambda: len(bpy.data.objects[name].data.vertices) < before)
    yield from picture("mended")
    undo()
    yield from until(lambda: len(bpy.data.objects[name].data.vertices) == before)
    bpy.data.objects.remove(bpy.data.objects[name])
    bpy.context.scene.mobius.largest_part = True
    bpy.context.scene.mobius.target = bpy.data.objects[names[1]]
    yield 0.5


def linked(names: tuple[str, str]) -> Wait:
    """What comes from a library can be a source, and says so as a target."""
    path = SHOTS / "library.blend"
    target = bpy.data.objects[names[1]]
    bpy.data.libraries.write(str(path), {target})
    with bpy.data.libraries.load(str(path), link=True) as (held, taken):
        taken.objects = held.objects
    there = taken.objects[0]
    bpy.context.scene.collection.objects.link(there)
    bpy.context.scene.mobius.target = there
    yield from picture("linked")
    assert not bpy.ops.mobius.align.poll() or refused()
    yield from only_read(there, bpy.data.objects[names[0]])
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = (bpy.data.objects[name] for name in names)
    bpy.data.libraries.remove(bpy.data.libraries[0])
    path.unlink()
    yield 0.5


def only_read(source: Any, target: Any) -> Wait:
    """A linked source is aligned by the button: the panel says before that it is only read, and it is."""
    settings, kept = bpy.context.scene.mobius, bpy.context.preferences.addons[PACKAGE].preferences
    settings.source, settings.target, kept.after_align = source, target, "side_by_side"
    bpy.ops.ed.undo_push(message="chosen")
    before = source.data.attributes.keys(), bpy.data.meshes.keys()
    yield from click_on((yield from find("bpy.ops.mobius.align")))
    yield from until(lambda: Job.current is not None)
    yield from until(lambda: Job.current is None)
    yield from picture("linked-source")
    assert (source.data.attributes.keys(), bpy.data.meshes.keys()) == before
    assert stored_alignment.exists(target, source)
    assert bpy.context.window_manager.mobius_view.matches, "what was found is not shown"
    assert not comparison.is_shown(bpy.context)
    bpy.context.window_manager.mobius_view.matches, kept.after_align = False, "nothing"
    undo()
    yield 1.0


def refused() -> bool:
    """Whether Align refuses the chosen pair, and says why."""
    try:
        bpy.ops.mobius.align("EXEC_DEFAULT", True, **QUICK)
    except RuntimeError as error:
        return "library" in str(error) or "linked" in str(error)
    return False
