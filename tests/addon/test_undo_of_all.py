"""One undo takes back every operator of the extension, whatever it has changed, and one redo does it again."""

from collections.abc import Callable
from typing import Any

import pytest
from scenes import QUICK, make_sheet
from whole_file import differences, whole_session

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

POINTS = {"source_point": (0.3, 0.2, 0.3), "target_point": (0.3, 0.2, 0.3)}


def _nothing() -> None:
    pass


def _align() -> None:
    bpy.ops.mobius.align(**QUICK)


def _pair() -> None:
    _align()
    bpy.ops.mobius.add_pair(**POINTS)


def _moved_pair() -> None:
    _pair()
    bpy.data.objects["Pair 1.001"].location.x += 0.05
    bpy.context.view_layer.update()


def _side_by_side() -> None:
    _align()
    bpy.ops.mobius.side_by_side()


def _select(*names: str) -> None:
    for obj in bpy.context.scene.objects:
        obj.select_set(obj.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[-1]]


def _both() -> None:
    _select("Target", "Source")


def _eye() -> None:
    make_sheet("Eye", 5)
    _select("Eye", "Source")


def _spike() -> None:
    make_sheet("Gap", 6, keep=lambda i, j: (i, j) != (2, 2)).data.materials.append(bpy.data.materials.new("Skin"))
    bpy.data.objects["Gap"].data.vertices.add(1)


# operator: what comes before it, and what it is told
CALLS: dict[str, tuple[Callable[[], None], dict[str, Any]]] = {
    "add_pair": (_align, POINTS),
    "align": (_nothing, QUICK),
    "align_selected": (_both, QUICK),
    "bend_through_pairs": (_moved_pair, {}),
    "check": (_spike, {}),
    "choose_target": (_nothing, {"object_name": "Target"}),
    "clear": (_align, {}),
    "conformal_transfer": (_both, QUICK),
    "end_side_by_side": (_side_by_side, {}),
    "flatten": (_nothing, {}),
    "heat_map": (_align, {}),
    "join_copy": (_eye, {"role": "source"}),
    "live": (_align, {"attribute": "Right"}),
    "mend": (_spike, {}),
    "remove_pair": (_pair, {}),
    "select_pair": (_pair, {"pair": "Pair 1"}),
    "select_unmatched": (_align, {}),
    "side_by_side": (_align, {}),
    "swap": (_nothing, {}),
    "transfer": (_align, {}),
    "use_selected": (lambda: _select("Source", "Target"), {}),
    "wrap": (_align, {}),
}


# their heads have so many vertices that a session takes half a minute to read: test_example.py has their undo
LARGE = {"load_example", "remove_example"}


def undoable() -> list[str]:
    """Names of the registered operators that ask Blender for an undo step."""
    return [name for name in dir(bpy.ops.mobius) if "UNDO" in getattr(bpy.ops.mobius, name).bl_options]


def test_no_operator_is_forgotten_here() -> None:
    assert set(undoable()) - LARGE == set(CALLS)


@pytest.fixture
def small(empty_scene: Any) -> tuple[Any, Any]:
    """Two chosen sheets of so few vertices that all of a session is soon read; the source has a group."""
    pair = make_sheet("Source", 10), make_sheet("Target", 9)
    pair[0].vertex_groups.new(name="Right").add(range(40), 0.5, "REPLACE")
    empty_scene.mobius.source, empty_scene.mobius.target = pair
    return pair


def state() -> dict[Any, Any]:
    """All that is in the session, with what no datablock lists: what is selected, and which layers are active."""
    layer = bpy.context.view_layer
    active = layer.objects.active
    own: dict[Any, Any] = {
        "selected": sorted(obj.name for obj in layer.objects if obj.select_get()),
        "hidden": sorted(obj.name for obj in layer.objects if obj.hide_get()),
        "active": active.name if active is not None else "",
        "mode": bpy.context.mode,
    }
    for obj in (obj for obj in bpy.data.objects if obj.type == "MESH"):
        mesh, groups = obj.data, obj.vertex_groups
        own[obj.name, "layers"] = [
            groups.active.name if groups.active is not None else "",
            mesh.uv_layers.active_index,
            [x.name for x in mesh.uv_layers if x.active_render],
            mesh.color_attributes.active_color_name or "",
            mesh.color_attributes.default_color_name or "",
            mesh.attributes.active.name if mesh.attributes.active is not None else "",
        ]
    return {**whole_session(), **own}


@pytest.mark.parametrize("name", CALLS)
def test_one_undo_takes_it_back_and_one_redo_does_it_again(small: tuple[Any, Any], name: str) -> None:
    prepare, told = CALLS[name]
    pair = small
    pair[0].shape_key_add(name="Basis")
    pair[0].shape_key_add(name="Smile").data[30].co.z += 0.2
    pair[1].data.color_attributes.new("Own", "FLOAT_COLOR", "POINT")
    prepare()
    if name not in ("check", "mend", "join_copy", "align_selected", "conformal_transfer", "use_selected"):
        bpy.context.view_layer.objects.active = pair[0]
    bpy.ops.ed.undo_push(message="before")
    before = state()
    assert getattr(bpy.ops.mobius, name)("EXEC_DEFAULT", True, **told) == {"FINISHED"}
    after = state()
    assert list(differences(before, after))
    bpy.ops.ed.undo()
    assert list(differences(before, state())) == []
    bpy.ops.ed.redo()
    assert list(differences(after, state())) == []
