"""Shape keys: carried with the surface, with all that belongs to them."""

from typing import Any

import numpy as np
import pytest
from scenes import bumps, make_sheet, positions
from test_attributes import flat, transfer

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402


def shape(obj: Any, name: str) -> np.ndarray:
    return np.array([point.co[:] for point in obj.data.shape_keys.key_blocks[name].points])


def add_key(obj: Any, name: str, displacement: np.ndarray) -> Any:
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    key = obj.shape_key_add(name=name, from_mix=False)
    key.points.foreach_set("co", (positions(obj) + displacement).astype(np.float32).ravel())
    return key


def same_vertices(source: Any, target: Any) -> Carrier:
    """Each vertex of the target corresponds to the source's of the same number."""
    surfaces = read_surface(source), read_surface(target)
    faces = surfaces[0].mesh.faces
    count = len(surfaces[0].mesh.vertices)
    face = np.empty(count, int)
    face[faces.ravel()] = np.arange(faces.size) // 3
    barycentric = (faces[face] == np.arange(count)[:, None]).astype(float)
    found = Correspondence(face, barycentric, np.ones(count, bool), np.ones(count), faces, count)
    return Carrier(found, *surfaces)


def test_shapes_and_sliders_come_back_bit_for_bit() -> None:
    source, target = make_sheet("Source", 8), make_sheet("Target", 8)
    rng = np.random.default_rng(0)
    smile = add_key(source, "Smile", rng.normal(size=(64, 3)))
    wide = add_key(source, "Wide", rng.normal(size=(64, 3)))
    smile.slider_min, smile.slider_max, smile.value = -0.5, 1.5, 0.25
    wide.relative_key, wide.mute = smile, True
    driver = wide.driver_add("value").driver
    driver.expression = "0.5"
    transfer(source, target, ["shape-keys"])
    keys = target.data.shape_keys.key_blocks
    assert keys.keys() == ["Basis", "Smile", "Wide"]
    for name in ("Basis", "Smile", "Wide"):
        assert (shape(target, name) == shape(source, name)).all()
    assert (keys["Smile"].slider_min, keys["Smile"].slider_max, keys["Smile"].value) == (-0.5, 1.5, 0.25)
    assert keys["Wide"].relative_key == keys["Smile"]
    assert keys["Wide"].mute
    drivers = target.data.shape_keys.animation_data.drivers
    assert [(x.data_path, x.driver.expression) for x in drivers] == [('key_blocks["Wide"].value', "0.5")]
    transfer(source, target, ["shape-keys"])
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Smile", "Wide"]
    assert len(target.data.shape_keys.animation_data.drivers) == 1


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_shape_turns_and_grows_with_the_surface(mirrored: bool) -> None:
    source, target = make_sheet("Source", 9), make_sheet("Target", 9)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    flip = np.diag([-1.0, 1.0, 1.0]) if mirrored else np.eye(3)
    if mirrored:
        # the mesh is the mirror image, and the object's scale mirrors it back: what is seen is the same
        target.data.flip_normals()
        target.scale.x = -1
        bpy.context.view_layer.update()
    moved = 3 * positions(source) @ turn.T @ flip + [1, 2, 3]
    target.data.vertices.foreach_set("co", moved.astype(np.float32).ravel())
    target.data.update()
    displacement = np.random.default_rng(2).normal(size=(81, 3))
    add_key(source, "Smile", displacement)
    plan_transfer(source, target, same_vertices(source, target), TransferSettings(kinds=("shape-keys",))).write(target)
    arrived = shape(target, "Smile") - positions(target)
    assert np.abs(arrived - 3 * displacement @ turn.T @ flip).max() < 1e-4


def test_between_triangulations_a_linear_shape_is_carried_exactly() -> None:
    source, target = make_sheet("Source", 9, flat), make_sheet("Target", 14, flat)
    matrix = np.random.default_rng(2).normal(size=(3, 3))
    add_key(source, "Lean", positions(source) @ matrix)
    transfer(source, target, ["shape-keys"])
    assert np.abs(shape(target, "Lean") - positions(target) - positions(target) @ matrix).max() < 1e-5


def test_locked_keys_and_vertices_without_counterpart_stay_as_they_are() -> None:
    source, target = make_sheet("Source", 6), make_sheet("Target", 6)
    for name in ("Smile", "Frown"):
        add_key(source, name, np.full((36, 3), 1.0))
        add_key(target, name, np.full((36, 3), 5.0))
    target.data.shape_keys.key_blocks["Frown"].lock_shape = True
    plan = transfer(source, target, ["shape-keys"], bare=slice(0, 6))
    assert "'Frown' is locked on 'Target' and left as it is" in plan.warnings
    moved = (shape(target, "Smile") - positions(target))[:, 0]
    assert moved == pytest.approx([5.0] * 6 + [1.0] * 30, abs=1e-5)
    assert shape(target, "Frown") - positions(target) == pytest.approx(5.0, abs=1e-5)


def test_a_shape_on_a_bent_surface_keeps_its_height_over_it() -> None:
    source, target = make_sheet("Source", 21, flat), make_sheet("Target", 21, lambda x, y: 2 * bumps(x, y))
    add_key(source, "Up", np.tile([0.0, 0.0, 0.1], (441, 1)))
    settings = TransferSettings(kinds=("shape-keys",), keys_by="frames")
    plan_transfer(source, target, same_vertices(source, target), settings).write(target)
    arrived = shape(target, "Up") - positions(target)
    normal = np.array([vertex.normal[:] for vertex in target.data.vertices])
    length = np.linalg.norm(arrived, axis=1)
    assert ((arrived * normal).sum(axis=1) / length).min() > 0.99
    assert length.min() > 0.099
