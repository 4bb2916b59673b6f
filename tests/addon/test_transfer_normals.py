"""Custom normals, turned with the surface."""

from typing import Any

import numpy as np
import pytest
from scenes import bumps, make_sheet, positions
from test_attributes import correspondence, flat
from test_transfer_shape_keys import same_vertices

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402

NORMALS = TransferSettings(kinds=("normals",))
ANGLE = 1.5e-4
"""Radians: Blender keeps two angles of 16 bits for a normal."""


def normals(obj: Any) -> np.ndarray:
    values = np.empty(3 * len(obj.data.loops), np.float32)
    obj.data.corner_normals.foreach_get("vector", values)
    return values.reshape(-1, 3).astype(float)


def shade_smooth(obj: Any) -> None:
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    obj.data.update()


def give(obj: Any, vectors: np.ndarray) -> None:
    obj.data.normals_split_custom_set(vectors.astype(np.float32).tolist())


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1) / length, (a * b).sum(axis=1) / length)


def leaning(obj: Any, seed: int = 0) -> np.ndarray:
    """Normals that lean away from the surface's, one to a vertex."""
    rng = np.random.default_rng(seed)
    own = np.array([v.normal[:] for v in obj.data.vertices])
    lean = own + 0.4 * rng.normal(size=own.shape)
    lean /= np.linalg.norm(lean, axis=1)[:, None]
    return lean[[loop.vertex_index for loop in obj.data.loops]]


@pytest.mark.parametrize("mirrored", [False, True])
def test_normals_turn_with_the_surface(mirrored: bool) -> None:
    source, target = make_sheet("Source", 9), make_sheet("Target", 9)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    flip = np.diag([-1.0, 1.0, 1.0]) if mirrored else np.eye(3)
    if mirrored:
        target.data.flip_normals()
        target.scale.x = -1
        bpy.context.view_layer.update()
    target.data.vertices.foreach_set("co", (3 * positions(source) @ turn.T @ flip).astype(np.float32).ravel())
    for obj in (source, target):
        shade_smooth(obj)
    give(source, leaning(source))
    plan_transfer(source, target, same_vertices(source, target), NORMALS).write(target)
    assert target.data.has_custom_normals
    at_vertex = np.zeros((81, 3))
    at_vertex[[loop.vertex_index for loop in source.data.loops]] = normals(source)
    expected = at_vertex[[loop.vertex_index for loop in target.data.loops]] @ turn.T @ flip
    assert angles(normals(target), expected).max() < 2 * ANGLE


def test_from_an_identical_mesh_they_come_back_as_exactly_as_blender_keeps_them() -> None:
    source, target = make_sheet("Source", 12), make_sheet("Target", 12)
    for obj in (source, target):
        shade_smooth(obj)
    sides = np.random.default_rng(1).random(len(source.data.edges)) < 0.3
    source.data.edges.foreach_set("use_edge_sharp", sides)
    rng = np.random.default_rng(2)
    give(source, normals(source) + 0.3 * rng.normal(size=(len(source.data.loops), 3)))
    everything = TransferSettings(kinds=("normals", "sharpness", "smoothness"))
    plan_transfer(source, target, same_vertices(source, target), everything).write(target)
    assert angles(normals(target), normals(source)).max() < ANGLE


def test_between_triangulations_a_linear_field_of_normals_arrives() -> None:
    source, target = make_sheet("Source", 15, flat), make_sheet("Target", 22, flat)
    for obj in (source, target):
        shade_smooth(obj)
    slope = np.array([[0.5, 0.1, 0.0], [-0.2, 0.3, 0.0], [0.0, 0.0, 0.0]])

    def field(obj: Any) -> np.ndarray:
        lean = positions(obj)[[loop.vertex_index for loop in obj.data.loops]] @ slope + np.array([0, 0, 1.0])
        return lean / np.linalg.norm(lean, axis=1)[:, None]

    give(source, field(source))
    found = correspondence(source, positions(target))
    plan_transfer(source, target, Carrier(found, read_surface(source), read_surface(target)), NORMALS).write(target)
    assert angles(normals(target), field(target)).max() < 2e-3


def test_vertices_without_counterpart_keep_the_normals_that_are_seen() -> None:
    source, target = make_sheet("Source", 9), make_sheet("Target", 9, lambda x, y: 2 * bumps(x, y))
    for obj in (source, target):
        shade_smooth(obj)
    give(source, leaning(source))
    before = normals(target)
    carrier = same_vertices(source, target)
    carrier.correspondence.face[:9] = -1
    plan_transfer(source, target, carrier, NORMALS).write(target)
    bare = np.array([min(p.vertices) < 9 for p in target.data.polygons]).repeat(4)
    after = normals(target)
    inner = bare & np.array([loop.vertex_index < 9 for loop in target.data.loops])
    assert angles(after[inner], before[inner]).max() < 2 * ANGLE
    assert angles(after[~bare], before[~bare]).max() > 0.2


def test_a_source_without_custom_normals_gives_none() -> None:
    source, target = make_sheet("Source", 6), make_sheet("Target", 6)
    with pytest.raises(Exception, match="'Source' has no custom normals to transfer"):
        plan_transfer(source, target, same_vertices(source, target), NORMALS)
