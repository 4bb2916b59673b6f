"""Runs in Blender's window, driven by `gui_shot.sh`: landmarks by empties, Live, Swap, and the discs put away again.

`bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib
from typing import Any

import hand
import numpy as np
from hand import Wait, click_on, escape, find, over_the_viewport, picture, undo, until
from mathutils import Euler, Vector

vars(hand).update(region=region, click=click, shot=shot)
demo = importlib.import_module(PACKAGE + ".mobius_addon.demo")
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job
panels = importlib.import_module(PACKAGE + ".mobius_addon.panel")
stored_alignment = importlib.import_module(PACKAGE + ".mobius_addon.stored_alignment")

MARKED = 0, 150, 300
"""Vertices of the target that an empty is put on."""


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    source, target, truth = demo.build_objects(bpy.context.scene)
    names = source.name, target.name
    target.scale = (0.55,) * 3
    target.location = Vector((2.6, 0.4, 0)) - 0.55 * Vector(sum(map(Vector, target.bound_box), Vector()) / 8)
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    bpy.context.preferences.addons[PACKAGE].preferences.after_align = "nothing"
    bpy.context.view_layer.update()
    bpy.context.space_data.region_3d.view_rotation = Euler((1.3, 0, 0.15)).to_quaternion()
    bpy.ops.view3d.view_all()
    for folded in (panels.MOBIUS_PT_pictures, panels.MOBIUS_PT_transfer, panels.MOBIUS_PT_fitted):
        bpy.utils.unregister_class(folded)  # so that the sidebar need not be scrolled
    bpy.utils.unregister_class(panels.MOBIUS_PT_live)
    panels.MOBIUS_PT_live.bl_options = set()
    bpy.utils.register_class(panels.MOBIUS_PT_live)
    yield 1.0

    # without empties a sentence, with them an alignment that follows them
    settings.landmarks = "empties"
    align = yield from find("bpy.ops.mobius.align")
    yield from click_on(align)
    yield from picture("empties-missing")
    assert Job.current is None
    escape()  # what is said
    there = truth.positions(np.array([vertex.co[:] for vertex in settings.source.data.vertices]))
    for vertex in MARKED:
        place = settings.target.data.vertices[vertex].co
        put(settings.target, f"Mark {vertex}", place)
        put(settings.source, f"Mark {vertex}", there[vertex])
    yield 0.5
    yield from click_on(align)
    yield from until(lambda: stored_alignment.exists(settings.target, settings.source))
    yield 0.5
    yield from picture("empties")

    # Live: what is painted on the source later is on the target
    settings.live_attribute = settings.source.vertex_groups[0].name
    yield 0.5
    live = yield from find("bpy.ops.mobius.live", upwards=True)
    yield from click_on(live)
    yield from until(lambda: any(x.type == "NODES" for x in settings.target.modifiers))
    before = seen(settings.target, settings.live_attribute)
    group = settings.source.vertex_groups[0]
    group.add(range(len(settings.source.data.vertices)), 0.25, "REPLACE")
    settings.source.data.update()
    yield 1.0
    after = seen(settings.target, settings.live_attribute)
    print(
        f"[clicks] live: {before.min():.2f} to {before.max():.2f}, {after.min():.2f} to {after.max():.2f}", flush=True
    )
    assert not np.allclose(before, after)
    assert np.isclose(after, 0.25, atol=1e-4).mean() > 0.5
    yield from picture("live")

    # Swap, and undo
    swap = yield from find("bpy.ops.mobius.swap")
    yield from click_on(swap)
    yield from until(lambda: settings_now().source.name == names[1])
    assert stored_alignment.exists(settings_now().target, settings_now().source), "the map the other way is kept"
    yield from picture("swapped")
    undo()
    yield 1.0
    assert (settings_now().source.name, settings_now().target.name) == names, "one undo swaps back"

    # the discs open an editor, which goes when everything is cleared
    count = len(bpy.context.screen.areas)
    bpy.ops.mobius.show_discs()
    yield 1.0
    assert len(bpy.context.screen.areas) == count + 1
    yield from picture("discs-opened")
    bpy.ops.mobius.clear("EXEC_DEFAULT", True)
    yield 1.0
    yield from picture("discs-closed")
    assert len(bpy.context.screen.areas) == count, "the editor of the discs is still there"
    assert not any(x.type == "NODES" for x in settings_now().target.modifiers)
    over_the_viewport()
    print("[clicks] done", flush=True)


def settings_now() -> Any:
    return bpy.context.scene.mobius


def put(parent: Any, name: str, place: Any) -> None:
    """Parent an empty to an object, at a place of its space."""
    empty = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(empty)
    empty.parent, empty.location, empty.empty_display_size = parent, place, 0.05


def seen(obj: Any, name: str) -> np.ndarray:
    """What an attribute is after the modifiers."""
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.zeros(len(shown.vertices), np.float32)
    shown.attributes[name].data.foreach_get("value", values)
    return values
