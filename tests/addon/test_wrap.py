"""The fitted shape: a new object with one mesh's triangles and all that is on them, in the other's shape."""

from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, everything, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

ACCURATE = QUICK | {"refine": "dense"}


def rolled(places: np.ndarray) -> np.ndarray:
    """Places rolled about one axis, hardly stretched."""
    angle, height = places[:, 0] / 1.2, places[:, 2]
    return np.stack([np.sin(angle) * (1.2 - height), places[:, 1], 1.2 - np.cos(angle) * (1.2 - height)], axis=1)


@pytest.fixture
def bent(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    """The pair of sheets, the target rolled and elsewhere; the source has keys and a material."""
    source, target = pair
    places = positions(target)
    target.data.vertices.foreach_set("co", rolled(places).astype(np.float32).ravel())
    target.data.update()
    target.location, target.rotation_euler, target.scale = (3, 1, 2), (0.4, 1.0, -0.3), (2, 2, 2)
    source.data.materials.append(bpy.data.materials.new("Skin"))
    source.shape_key_add(name="Basis")
    key = source.shape_key_add(name="Up", from_mix=False)
    up = positions(source)
    up[:, 2] += 0.1 * np.exp(-8 * (up[:, 0] ** 2 + up[:, 1] ** 2))
    key.points.foreach_set("co", up.astype(np.float32).ravel())
    bpy.context.view_layer.update()
    return source, target


def made() -> Any:
    return bpy.context.view_layer.objects.active


def test_the_source_lies_on_the_target_with_all_that_is_on_it(bent: tuple[Any, Any]) -> None:
    source, target = bent
    bpy.ops.mobius.align(**ACCURATE)
    before = everything(source), everything(target)
    bpy.ops.ed.undo_push(message="aligned")
    assert bpy.ops.mobius.wrap("EXEC_DEFAULT", True) == {"FINISHED"}
    obj = made()
    assert obj.name == "Source on Target"
    assert (everything(source), everything(target)) == before
    assert obj.data != source.data
    assert np.allclose(obj.matrix_world, target.matrix_world)
    assert len(obj.data.polygons) == len(source.data.polygons)
    # where the sheet's points belong, in the target's space; 0.5 % of the diagonal
    off = np.linalg.norm(positions(obj) - rolled(positions(source)), axis=1)
    assert np.median(off) < 0.015
    assert (weights(obj, "Right") == weights(source, "Right")).all()
    assert (corner_values(obj, "UVMap") == corner_values(source, "UVMap")).all()
    assert [slot.material.name for slot in obj.material_slots] == ["Skin"]
    assert obj.data.shape_keys.key_blocks.keys() == ["Basis", "Up"]
    assert obj.data.shape_keys != source.data.shape_keys
    basis, up = (np.array([x.co[:] for x in obj.data.shape_keys.key_blocks[name].points]) for name in ("Basis", "Up"))
    assert (basis == positions(obj)).all()
    middle = 10 * 21 + 10
    step = (up - basis)[middle]
    assert np.linalg.norm(step) == pytest.approx(0.1, rel=0.1)
    assert step[2] / np.linalg.norm(step) > 0.98  # where the roll begins, upwards is upwards
    assert not [name for name in (*obj.vertex_groups.keys(), *obj.data.attributes.keys()) if "Mobius" in name]
    assert not obj.data.mobius_alignment.target_fingerprint
    bpy.ops.ed.undo()
    assert "Source on Target" not in bpy.data.objects


@pytest.mark.parametrize("how", ["object", "mesh", "map"])
def test_faces_keep_their_outside(bent: tuple[Any, Any], how: str) -> None:
    """A target that is mirrored by its scale, one that is mirrored itself, and a map that mirrors."""
    source, target = bent
    if how == "object":
        target.scale = (-2, 2, 2)
    else:
        places = positions(target) * (-1, 1, 1)
        target.data.vertices.foreach_set("co", places.astype(np.float32).ravel())
        target.data.flip_normals()
    bpy.context.view_layer.update()
    bpy.ops.mobius.align(**ACCURATE | {"reflect": "always"})
    bpy.ops.mobius.wrap()
    obj = made()
    there = {"object": 1, "mesh": -1, "map": -1}[how]
    off = np.linalg.norm(positions(obj) - rolled(positions(source)) * (there, 1, 1), axis=1)
    assert np.median(off) < 0.02
    middle = 7 * 16 + 7
    # both look the same way where they lie over each other
    near = np.argmin(np.linalg.norm(positions(obj) - positions(target)[middle], axis=1))
    assert np.dot(obj.data.vertices[int(near)].normal, target.data.vertices[middle].normal) > 0.9


def test_the_target_gets_the_sources_shape_as_a_key_on_a_copy(bent: tuple[Any, Any]) -> None:
    source, target = bent
    bpy.ops.mobius.align(**ACCURATE)
    before = everything(source), everything(target)
    bpy.ops.mobius.wrap(fitted="target")
    obj = made()
    assert (everything(source), everything(target)) == before
    assert target.data.shape_keys is None
    keys = obj.data.shape_keys.key_blocks
    assert keys.keys() == ["Basis", "Source"]
    assert keys["Source"].value == 1
    assert (np.array([x.co[:] for x in keys["Basis"].points]) == positions(target)).all()
    # unrolled: lengths of edges are those of the flat sheet
    shape = np.array([x.co[:] for x in keys["Source"].points])
    flat = make_sheet("Flat", 16)
    edges = np.array([edge.vertices[:] for edge in flat.data.edges])
    lengths = [np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (shape, positions(flat))]
    ratio = lengths[0] / lengths[1]
    assert np.abs(ratio / np.median(ratio) - 1).mean() < 0.05


def test_it_says_what_is_in_the_way(pair: tuple[Any, Any]) -> None:
    with pytest.raises(RuntimeError, match="has not been aligned"):
        bpy.ops.mobius.wrap()
    bpy.ops.mobius.align(**QUICK)
    pair[1].data.vertices[3].co.z += 1
    pair[1].data.update()
    with pytest.raises(RuntimeError, match="has been edited since it was aligned"):
        bpy.ops.mobius.wrap()
    assert len(bpy.data.objects) == 2


def test_a_new_object_is_seen_where_both_were_shown_side_by_side(bent: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    assert bpy.ops.mobius.side_by_side("EXEC_DEFAULT", True) == {"FINISHED"}
    assert "Mobius Side by Side" in bpy.context.scene.collection.children
    assert bpy.ops.mobius.wrap("EXEC_DEFAULT", True) == {"FINISHED"}
    assert "Mobius Side by Side" not in bpy.context.scene.collection.children
    assert bpy.context.selected_objects == [made()]
    assert made().name == "Source on Target"


@pytest.mark.parametrize("scale", [(1, 3, 1), (-1, 3, 1)])
def test_it_lies_on_a_target_that_its_parent_shears(bent: tuple[Any, Any], scale: tuple[float, ...]) -> None:
    """No object without a parent has such a place: its mesh and all its keys are sheared."""
    source, target = bent
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale, target.parent = scale, parent
    bpy.context.view_layer.update()

    def in_world(obj: Any, key: str | None = None) -> np.ndarray:
        places = positions(obj) if key is None else [x.co[:] for x in obj.data.shape_keys.key_blocks[key].points]
        matrix = np.array(obj.matrix_world)
        return np.asarray(places) @ matrix[:3, :3].T + matrix[:3, 3]

    bpy.ops.mobius.align(**ACCURATE | {"reflect": "always" if scale[0] < 0 else "never"})
    before = everything(source), everything(target)
    bpy.ops.mobius.wrap()
    bpy.context.view_layer.update()
    right = rolled(positions(source))
    matrix = np.array(target.matrix_world)
    right = right @ matrix[:3, :3].T + matrix[:3, 3]
    off = np.linalg.norm(in_world(made(), "Basis") - right, axis=1)
    assert np.median(off) < 0.005 * np.linalg.norm(np.ptp(right, axis=0))
    assert (in_world(made()) == in_world(made(), "Basis")).all()
    bpy.ops.mobius.wrap(fitted="target")
    bpy.context.view_layer.update()
    assert np.allclose(in_world(made(), "Basis"), in_world(target), atol=1e-4)
    assert (everything(source), everything(target)) == before


@pytest.mark.parametrize("fitted", ["source", "target"])
@pytest.mark.parametrize("parent", [False, True])
def test_onto_a_target_without_height_the_mesh_keeps_its_own(bent: tuple[Any, Any], fitted: str, parent: bool) -> None:
    """A scale of 0 can be taken back; what is gone from a mesh cannot."""
    _, target = bent
    flat = target
    if parent:
        flat = bpy.data.objects.new("Flat", None)
        bpy.context.scene.collection.objects.link(flat)
        target.parent = flat
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert bpy.ops.mobius.wrap(fitted=fitted) == {"FINISHED"}
    wanted = positions(bpy.context.object)
    flat.scale.z = 0
    bpy.context.view_layer.update()
    assert bpy.ops.mobius.wrap(fitted=fitted) == {"FINISHED"}
    assert bpy.context.object.name.endswith(".001")
    np.testing.assert_allclose(positions(bpy.context.object), wanted, atol=1e-5)
