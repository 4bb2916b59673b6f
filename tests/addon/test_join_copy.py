"""Several objects as one thing in the panel: a joined copy of them is chosen, and they stay as they are."""

from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.joined import joined  # noqa: E402
from mobius_extension.mobius_addon.operators.join_copy import selected_with  # noqa: E402


@pytest.fixture
def head() -> tuple[Any, Any, Any]:
    """A head with an eye apart from it, which is small and moved, and a target."""
    target, eye, head = make_sheet("Target", 21), make_sheet("Eye", 5), make_sheet("Head", 21)
    eye.scale, eye.location = (0.1,) * 3, (0.0, 0.0, 1.0)
    head.vertex_groups.new(name="Jaw").add(range(50), 1.0, "REPLACE")
    eye.vertex_groups.new(name="Lid").add(range(5), 1.0, "REPLACE")
    settings = bpy.context.scene.mobius
    settings.source, settings.target = head, target
    eye.select_set(True)
    bpy.context.view_layer.update()
    return head, eye, target


def test_a_joined_copy_is_taken_as_one_thing(head: tuple[Any, Any, Any]) -> None:
    source, eye, _ = head
    settings = bpy.context.scene.mobius
    before = positions(source).tolist(), positions(eye).tolist()
    assert selected_with(bpy.context, "source") == [eye]
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.mobius.join_copy("EXEC_DEFAULT", True, role="source") == {"FINISHED"}
    whole = settings.source
    assert whole.name == "Head Joined"
    assert len(whole.data.vertices) == len(source.data.vertices) + len(eye.data.vertices)
    assert {group.name for group in whole.vertex_groups} == {"Jaw", "Lid"}
    assert list(whole.users_collection) == list(source.users_collection)
    assert (positions(source).tolist(), positions(eye).tolist()) == before
    assert source.hide_get()
    assert eye.hide_get()
    assert bpy.context.selected_objects == [whole]
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    bpy.ops.ed.undo()
    settings = bpy.context.scene.mobius
    assert (settings.source.name, settings.target.name) == ("Head", "Target")
    assert "Head Joined" not in bpy.data.objects
    assert not settings.source.hide_get()


def test_it_is_offered_where_meshes_of_one_side_are_selected(head: tuple[Any, Any, Any]) -> None:
    source, eye, target = head
    assert selected_with(bpy.context, "target") == []
    target.select_set(True)  # which is what Use Selected and Align Selected are for
    assert selected_with(bpy.context, "source") == []
    source.select_set(False)
    assert selected_with(bpy.context, "target") == [eye]
    eye.select_set(False)
    assert selected_with(bpy.context, "target") == []
    with pytest.raises(RuntimeError, match="Select the meshes that are one thing with the chosen one"):
        bpy.ops.mobius.join_copy(role="target")


@pytest.mark.parametrize("mirrored", ["eye", "head", "both"])
def test_what_a_negative_scale_mirrors_is_not_joined_inside_out(head: tuple[Any, Any, Any], mirrored: str) -> None:
    source, eye, _ = head
    for obj, name in ((source, "head"), (eye, "eye")):
        if mirrored in (name, "both"):
            obj.scale.x *= -1
        obj.data.uv_layers.new(name="UVMap")
        values = np.random.default_rng(len(obj.data.loops)).random((len(obj.data.loops), 2))
        obj.data.uv_layers["UVMap"].uv.foreach_set("vector", values.astype(np.float32).ravel())
    bpy.context.view_layer.update()

    def seen(obj: Any) -> list[tuple[float, ...]]:
        """Each corner's place and map, and which way its face looks in the world."""
        own, matrix = positions(obj), np.array(obj.matrix_world)
        places = own @ matrix[:3, :3].T + matrix[:3, 3]
        turn = np.linalg.inv(matrix[:3, :3])
        looks = np.array([polygon.normal[:] for polygon in obj.data.polygons]) @ turn
        uv = corner_values(obj, "UVMap")
        corners = [
            (*places[obj.data.loops[k].vertex_index], *uv[k], *(looks[face] / np.linalg.norm(looks[face])))
            for face, polygon in enumerate(obj.data.polygons)
            for k in polygon.loop_indices
        ]
        return sorted(tuple(float(x) for x in np.round(corner, 3) + 0.0) for corner in corners)

    before = sorted(seen(source) + seen(eye))
    with joined([source, eye], "Whole") as (whole, members):
        bpy.context.view_layer.update()
        all_uv = corner_values(whole, "UVMap")
        for member in members:  # each corner finds its own
            assert np.allclose(all_uv[member.numbers["CORNER"]], corner_values(member.obj, "UVMap"))
    bpy.ops.mobius.join_copy(role="source")
    bpy.context.view_layer.update()
    assert np.allclose(seen(bpy.context.scene.mobius.source), before, atol=2e-3)
    assert sorted(seen(source) + seen(eye)) == before
