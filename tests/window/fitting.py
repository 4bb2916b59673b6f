"""Runs in Blender's window, driven by `gui_shot.sh`: Fitted Shape, its redo panel, and undo.

`bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib
from typing import Any

import hand
from hand import Wait, click_on, find, over_the_viewport, picture, pointer, redo, screen_height, undo, until
from redoing import show_panel
from two_heads import aligned_heads

vars(hand).update(region=region, click=click, shot=shot)
Job = importlib.import_module(PACKAGE + ".mobius_addon.job").Job


def steps() -> Wait:
    """Make the fitted shape by its button, exchange in the redo panel which is bent, and take it back."""
    source, target = aligned_heads(PACKAGE)
    yield 1.0
    before, own = scene(), set(bpy.data.objects.keys())
    onto, as_source = f"{source.name} on {target.name}", f"{target.name} as {source.name}"

    def made(name: str) -> Any:
        return lambda: Job.current is None and set(bpy.data.objects.keys()) == own | {name}

    def undone() -> Wait:
        undo()
        yield from until(lambda: set(bpy.data.objects.keys()) == own)
        yield 1.0
        same(scene(), before)

    yield from click_on((yield from find("bpy.ops.mobius.wrap")))
    yield from until(made(onto))
    yield 1.0
    first = scene()
    yield from picture("fitted")
    yield from show_panel()
    yield from turned_over()
    yield from until(made(as_source))
    yield from picture("redo-fitted")
    new = bpy.data.objects[as_source]
    assert (bpy.context.object, bpy.context.selected_objects) == (new, [new])
    assert new.data.shape_keys.key_blocks[-1].value == 1.0
    # the redo panel undoes, and what is not evaluated lies at the origin
    assert new.matrix_world == bpy.context.scene.mobius.target.matrix_world, "it does not lie at the target"
    assert len(bpy.data.meshes) == len(before["meshes"]) + 1, "what was made first is left behind"
    yield from turned_over()
    yield from until(made(onto))
    yield 1.0
    same(scene(), first)
    yield from undone()
    redo()
    yield from until(made(onto))
    yield 1.0
    same(scene(), first)
    yield from undone()
    print("[clicks] done", flush=True)


def turned_over() -> Wait:
    """Turn the redo panel's choice over by the mouse wheel above it, wherever in the panel it is."""
    chosen = lambda: bpy.context.window_manager.operators[-1].fitted  # noqa: E731
    before, panel = chosen(), hand.region("HUD")
    top = screen_height() - (panel.y + panel.height)
    places = range(top + 20, screen_height() - panel.y, 8)
    for y in 3 * [*places]:  # a busy machine has not seen every move in time
        for beside in (-2, 0):
            pointer("mousemove", panel.x + int(0.7 * panel.width) + beside, y)
            yield 0.2
        wheel = 5 if before == "source" else 4
        pointer("keydown", "ctrl", "click", wheel, "keyup", "ctrl")
        yield 0.4
        if chosen() != before:
            over_the_viewport()
            return
    raise AssertionError("the redo panel shows no choice of what is bent")


def scene() -> dict[str, Any]:
    """Everything that Fitted Shape could change in the file."""
    return {
        "meshes": sorted(map(content, bpy.data.meshes), key=str),
        "keys": sorted(bpy.data.shape_keys.keys()),
        "objects": {
            obj.name: (obj.data.name, [list(row) for row in obj.matrix_world], obj.vertex_groups.keys())
            for obj in bpy.data.objects
        },
        "collections": {x.name: sorted(x.objects.keys()) for x in bpy.data.collections},
        "top": sorted(bpy.context.scene.collection.objects.keys()),
        "selected": sorted(obj.name for obj in bpy.context.selected_objects),
        "active": getattr(bpy.context.object, "name", None),
        "chosen": [getattr(bpy.context.scene.mobius, role).name for role in ("source", "target")],
    }


def same(now: dict[str, Any], then: dict[str, Any]) -> None:
    """Say what is otherwise than it was, if anything is."""
    differs = {name: (then[name], now[name]) for name in then if then[name] != now[name]}
    assert not differs, f"not what it was: {differs}"


def content(mesh: Any) -> tuple[Any, ...]:
    """A mesh's name, places, keys, layers and what is kept of its alignment."""
    places = [0.0] * (3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", places)
    keys = mesh.shape_keys
    layers = sorted((x.name, x.data_type, x.domain) for x in mesh.attributes)
    kept = bytes(mesh.mobius_alignment.packed)
    return mesh.name, hash(tuple(places)), keys.key_blocks.keys() if keys else [], layers, hash(kept)
