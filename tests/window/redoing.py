"""After Transfer and after Transfer by Conformal Map: other settings in the redo panel, undo, redo, and once more.

A field is found as a person could: the mouse goes down the panel, and Ctrl C copies the value under it. Ctrl V sets it.
"""

import importlib
import time
from typing import Any

import bpy
import hand
from hand import Wait, click_on, find, over_the_viewport, picture, pointer, redo, screen_height, undo, until

LONGEST = 6.0
"""Seconds that a redo may take with a frozen window, on a busy machine that draws by software."""


def steps(package: str, names: tuple[str, str]) -> Wait:
    """Begin where the two meshes of these names are aligned and data was transferred, and end there.

    The names are those of the source and the target.
    """
    jobs = importlib.import_module(package + ".mobius_addon.jobs")
    align = importlib.import_module(package + ".mobius_addon.operators.align")
    searches: list[int] = []
    computed = align.aligned
    align.aligned = lambda *given, **options: (searches.append(1), computed(*given, **options))[1]

    def weight() -> float:
        return weight_of(names)

    def reaches(wanted: float) -> Any:
        return lambda: jobs.Job.current is None and abs(weight() - wanted) < 0.02 * abs(wanted)

    def transfer() -> Wait:
        yield from click_on((yield from find("bpy.ops.mobius.transfer", upwards=True)))
        yield from until(lambda: jobs.Job.current is None and weight() > 0)
        yield 1.0

    undo()
    yield from until(lambda: weight() == -1)
    yield from every_way_to_redo("transfer", transfer, weight, reaches)
    assert not searches, "a transfer needs no search"

    # as it was before any alignment, whose result is known no more
    undo()
    yield 1.0
    align.forget_last()
    source, target = (bpy.data.objects[name] for name in names)
    assert not target.data.mobius_alignment.target_fingerprint
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in (source, target))
    bpy.context.view_layer.objects.active = source
    bpy.ops.ed.undo_push(message="selection")

    def conformal_transfer() -> Wait:
        bpy.ops.mobius.conformal_transfer("INVOKE_DEFAULT", True)
        over_the_viewport()
        yield from until(lambda: jobs.Job.current is None and weight() > 0)
        yield 1.0

    yield from every_way_to_redo("conformal-transfer", conformal_transfer, weight, reaches)
    assert len(searches) == 1, "a redo has searched again"
    align.aligned = computed
    # to where this began
    bpy.ops.mobius.align("EXEC_DEFAULT", True)
    bpy.ops.mobius.transfer("EXEC_DEFAULT", True)
    yield 1.0


def after_opening(package: str, names: tuple[str, str]) -> Wait:
    """Transfer by the result that a file was saved with, answer the redo panel, and take it back."""
    jobs = importlib.import_module(package + ".mobius_addon.jobs")
    bpy.data.objects[names[1]].vertex_groups.clear()
    bpy.ops.ed.undo_push(message="no groups")
    yield from click_on((yield from find("bpy.ops.mobius.transfer", upwards=True)))
    yield from until(lambda: jobs.Job.current is None and weight_of(names) > 0)
    yield 1.0
    whole = weight_of(names)
    yield from show_panel()
    yield from set_factor(panel_rows(), 0.5)
    yield from quickly(
        lambda: abs(weight_of(names) - 0.5 * whole) < 0.02 * whole, "transfer in an opened file, redo panel"
    )
    yield from picture("reopened-redo")
    undo()
    yield from until(lambda: weight_of(names) == -1)


def weight_of(names: tuple[str, str]) -> float:
    """Return the sum of the weights that the target has of the source's first group; -1 without the group."""
    source, target = (bpy.data.objects[name] for name in names)
    group = source.vertex_groups[0].name
    if group not in target.vertex_groups:
        return -1.0
    index = target.vertex_groups[group].index
    return sum(member.weight for vertex in target.data.vertices for member in vertex.groups if member.group == index)


def every_way_to_redo(name: str, run: Any, weight: Any, reaches: Any) -> Wait:
    """Run an operator and change the factor by which weights are mixed in, in the panel that Blender offers."""
    yield from run()
    whole = weight()
    yield from show_panel()
    for factor in (0.5, 0.8, 0.25):
        yield from set_factor(panel_rows(), factor)
        yield from quickly(reaches(factor * whole), f"{name}, redo panel")
    yield from picture(f"redo-{name}")
    over_the_viewport()
    yield 0.5
    # once more on what is there: a quarter of the way that is left
    pointer("key", "shift+r")
    yield from until(reaches((0.25 + 0.75 * 0.25) * whole))
    yield 1.0
    yield from show_panel()
    yield from set_factor(panel_rows(), 0.5)
    yield from quickly(reaches((0.25 + 0.75 * 0.5) * whole), f"{name}, redo panel of Repeat Last")

    undo()
    yield from until(reaches(0.25 * whole))
    yield 0.5
    undo()
    yield from until(lambda: weight() == -1)
    yield 0.5
    redo()
    yield from until(reaches(0.25 * whole))
    yield 0.5
    undo()
    yield from until(lambda: weight() == -1)
    yield 0.5
    # undo has closed the panel
    yield from run()
    assert reaches(whole)(), f"{name} again: {weight():.1f} in place of {whole:.1f}"
    yield from show_panel()
    yield from set_factor(panel_rows(), 0.5)
    yield from quickly(reaches(0.5 * whole), f"{name}, redo panel after undo and redo")
    undo()
    yield from until(lambda: weight() == -1)
    yield 0.5


def quickly(happened: Any, what: str) -> Wait:
    start = time.perf_counter()
    yield from until(happened, every=0.02)
    spent = time.perf_counter() - start
    print(f"[clicks] {what}: answered after {spent:.2f} s", flush=True)
    assert spent < LONGEST, f"{what} took {spent:.1f} s"
    yield 0.5


def show_panel() -> Wait:
    """Unfold the panel at the bottom left of the viewport, if it is folded."""
    yield 0.5
    panel = hand.region("HUD")
    assert panel.width > 1, "there is no redo panel"
    if panel.height < 60:
        hand.click(panel.x + 60, screen_height() - (panel.y + panel.height) + 12)
        yield 1.0


def panel_rows() -> list[tuple[int, int]]:
    """Return where the fields of the redo panel may be, from its top to its bottom."""
    panel = hand.region("HUD")
    top = screen_height() - (panel.y + max(panel.height, 588))
    return [(panel.x + 220, y) for y in range(top, screen_height() - panel.y, hand.STEP)]


def set_factor(places: list[tuple[int, int]], factor: float) -> Wait:
    """Set the field Factor, the only one that is neither 0 nor the smallest weight.

    Looked for again where a slow machine has not answered in time.
    """
    manager = bpy.context.window_manager
    for place in 3 * places:
        if number((yield from hand.copied(place))) > 0.01:
            manager.clipboard = str(factor)
            pointer("key", "ctrl+v")
            return
    raise AssertionError("the redo panel shows no factor")


def number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
