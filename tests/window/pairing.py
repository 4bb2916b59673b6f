"""Runs in Blender's window, driven by `gui_shot.sh`: a map corrected by real clicks on the two meshes.

`bpy`, `PACKAGE`, `region`, `click` and `shot` are the driver's.
"""

import importlib
from typing import Any

import hand
from bpy_extras.view3d_utils import location_3d_to_region_2d, region_2d_to_origin_3d, region_2d_to_vector_3d
from hand import Wait, click_on, escape, picture, screen_height, undo, until
from mathutils import Vector
from two_heads import aligned_heads

vars(hand).update(region=region, click=click, shot=shot)
point_pairs = importlib.import_module(PACKAGE + ".mobius_addon.point_pairs")
mesh_data = importlib.import_module(PACKAGE + ".mobius_addon.mesh_data")
stored_alignment = importlib.import_module(PACKAGE + ".mobius_addon.stored_alignment")
panels = importlib.import_module(PACKAGE + ".mobius_addon.panel")


def steps() -> Wait:
    """Everything, with the seconds to wait in between."""
    source, target = aligned_heads(PACKAGE)
    names = source.name, target.name
    bpy.utils.unregister_class(panels.MOBIUS_PT_pairs)
    panels.MOBIUS_PT_pairs.bl_options = set()  # unfolded: the guide shows it
    bpy.utils.register_class(panels.MOBIUS_PT_pairs)
    yield 1.0
    before = bytes(target.data.mobius_alignment.packed)

    bpy.ops.mobius.add_pair("INVOKE_DEFAULT")
    yield 0.5
    escape()
    yield 1.0
    assert not point_pairs.listed(source, target), "ESC has left a pair"

    for number, vertex in enumerate(seen_on_both(source, target), 1):
        bpy.ops.mobius.add_pair("INVOKE_DEFAULT")
        yield 1.0
        beside = carried(source, target)[vertex] + Vector((0.015, 0, 0))
        for place in (source.matrix_world @ beside, target.matrix_world @ target.data.vertices[vertex].co):
            yield from click_on(on_screen(place))
            yield 0.5
        yield from until(lambda number=number: len(point_pairs.listed(source, target)) == number)
        yield 0.5
    found = point_pairs.listed(source, target)
    print(f"[clicks] pairs by clicks: {[(x.name, x.followed, x.missed) for x in found]}", flush=True)
    assert all(x.followed for x in found), "a pair that agrees with the map is outvoted"
    assert bytes(target.data.mobius_alignment.packed) != before, "the map is not bent"
    yield from picture("point-pairs")
    undo()
    yield 1.0
    pair = tuple(bpy.data.objects[name] for name in names)
    assert len(point_pairs.listed(*pair)) == 1, "one undo takes back one pair"
    undo()
    yield 1.0
    pair = tuple(bpy.data.objects[name] for name in names)
    assert bytes(pair[1].data.mobius_alignment.packed) == before, "undo brings the map back"
    print("[clicks] done", flush=True)


def carried(source: Any, target: Any) -> list[Vector]:
    """Where the target's vertices go, in the source's own space."""
    surfaces = mesh_data.read_surface(source), mesh_data.read_surface(target)
    found = stored_alignment.load(target, source, surfaces)
    return [Vector(place) for place in found.matrix() @ surfaces[0].mesh.vertices]


def seen_on_both(source: Any, target: Any) -> list[int]:
    """Return two vertices of the target, far apart, that are seen together with where they go on the source."""
    places, found = carried(source, target), []
    for vertex in range(0, len(places), 37):
        ends = source.matrix_world @ places[vertex], target.matrix_world @ target.data.vertices[vertex].co
        apart = [(places[vertex] - places[other]).length for other in found]
        if len(found) < 2 and min(apart, default=1.0) > 0.4 and all(is_seen(place) for place in ends):
            found.append(vertex)
    assert len(found) == 2, "the two heads show too little in common"
    return found


def is_seen(place: Vector) -> bool:
    """Whether a place of the world is in sight, and not under the toolbar or the sidebar."""
    part, view = region("WINDOW"), bpy.context.space_data.region_3d
    at = location_3d_to_region_2d(part, view, place)
    if at is None or not (0.1 * part.width < at.x < 0.65 * part.width and 0.2 * part.height < at.y < 0.9 * part.height):
        return False
    start, way = region_2d_to_origin_3d(part, view, at), region_2d_to_vector_3d(part, view, at)
    hit, there, normal, *_ = bpy.context.scene.ray_cast(bpy.context.view_layer.depsgraph, start, way)
    return hit and (there - place).length < 0.02 and normal.dot(way) < -0.5


def on_screen(place: Vector) -> tuple[int, int]:
    """Return where a place of the world is seen."""
    part = region("WINDOW")
    x, y = location_3d_to_region_2d(part, bpy.context.space_data.region_3d, place)
    return round(part.x + x), round(screen_height() - part.y - y)
