"""What a transfer promises in figures: everything at once from an identical mesh, a checker map, a round trip."""

import sys
from typing import Any

import numpy as np
import pytest
from scenes import bumps, corner_values, make_object, make_sheet, positions, weights
from test_attributes import EVERY_ROW
from test_transfer_shape_keys import add_key, same_vertices, shape
from test_transfer_types import SIZE, put, random_values

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import foreach, read_surface  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402
from mobius_extension.solver.flatten.locate import TriangulatedDisc  # noqa: E402


def test_everything_at_once_comes_back_bit_for_bit_from_an_identical_mesh() -> None:
    source, target = make_sheet("Source", 8), make_sheet("Target", 8)
    rng = np.random.default_rng(5)
    mesh = source.data
    for row in EVERY_ROW:
        if row.kind == "uv":
            continue
        count = len(getattr(mesh, SIZE[row.access.domain]))
        put(source, row, f"{row.access.data_type} {row.access.domain}",
            random_values(row.access.data_type, count, row.access.width))  # fmt: skip
    given = rng.dirichlet(np.full(3, 0.5), 64).astype(np.float32)
    given[given < 0.001] = 0  # smaller ones are left out
    for name, column in zip("ABC", given.T, strict=True):
        group = source.vertex_groups.new(name=name)
        for index in np.flatnonzero(column).tolist():
            group.add((index,), float(column[index]), "REPLACE")
    for number in range(8):
        uv = mesh.uv_layers.new(name=f"UV{number}").uv
        uv.foreach_set("vector", rng.random(2 * len(mesh.loops)).astype(np.float32))  # every face an island
    add_key(source, "Smile", rng.normal(size=(64, 3)))
    for name in ("use_seam", "use_edge_sharp"):
        mesh.edges.foreach_set(name, rng.random(len(mesh.edges)) < 0.3)
    plan = plan_transfer(source, target, same_vertices(source, target))
    plan.write(target)
    assert plan.warnings == ()
    for row in EVERY_ROW:
        if row.kind != "uv":
            name = f"{row.access.data_type} {row.access.domain}"
            assert (row.access.read(target, name) == row.access.read(source, name)).all(), name
    for column, name in zip(given.T, "ABC", strict=True):
        assert (weights(target, name) == column).all()
    for number in range(8):
        assert (corner_values(target, f"UV{number}") == corner_values(source, f"UV{number}")).all()
    assert (shape(target, "Smile") == shape(source, "Smile")).all()
    for name in ("use_seam", "use_edge_sharp"):
        assert (foreach(target.data.edges, name, 1, np.bool_) == foreach(mesh.edges, name, 1, np.bool_)).all()


def located(source: Any, target: Any) -> Carrier:
    """Carry between two meshes over the same square."""
    surfaces = read_surface(source), read_surface(target)
    plane = [s.mesh.vertices[:, 0] / 2 + 0.5j * s.mesh.vertices[:, 1] for s in surfaces]
    faces, count = surfaces[0].mesh.faces, len(plane[1])
    face, barycentric = TriangulatedDisc.of(plane[0], faces).locate(plane[1])
    found = Correspondence(face, barycentric, np.ones(count, bool), np.ones(count), faces, len(plane[0]))
    return Carrier(found, *surfaces)


def remeshed(name: str, seed: int, count: int) -> Any:
    """The bumpy sheet in triangles between points at random."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    side = np.linspace(-1, 1, 30)
    rim = np.concatenate([np.stack([side, s + 0 * side], 1) for s in (-1, 1)])
    rim = np.unique(np.concatenate([rim, rim[:, ::-1]]), axis=0)
    plane = np.concatenate([rim, rng.uniform(-0.99, 0.99, (count, 2))])
    faces = Delaunay(plane).simplices
    return make_object(name, np.column_stack([plane, bumps(*plane.T)]).tolist(), faces.tolist())


def islands(plane: np.ndarray) -> np.ndarray:
    """Four islands over the square, cut along x = 0.2 and y = -0.1."""
    return (plane[:, 0] > 0.2) + 2 * (plane[:, 1] > -0.1)


def laid_out(plane: np.ndarray, island: np.ndarray) -> np.ndarray:
    """Where points of the square lie in the UV map, within their island."""
    return plane * [0.9, 0.7] + np.stack([3.0 * (island % 2), 3.0 * (island // 2)], axis=-1)


def test_a_checker_map_on_a_remeshed_copy_is_right_at_all_but_one_corner_in_a_hundred(
    capsys: pytest.CaptureFixture[str],
) -> None:
    n = 81  # the cuts run along edges
    source, target = make_sheet("Source", n), remeshed("Target", 1, 4000)
    surface = read_surface(source)
    middle = positions(source)[surface.corner_vertex, :2].reshape(-1, 4, 2).mean(axis=1)
    island = np.repeat(islands(middle), 4)
    corner = positions(source)[surface.corner_vertex, :2]
    source.data.uv_layers.new(name="Checker").uv.foreach_set(
        "vector", laid_out(corner, island).astype(np.float32).ravel()
    )
    plan_transfer(source, target, located(source, target), TransferSettings(kinds=("uv",))).write(target)
    uv = corner_values(target, "Checker").reshape(-1, 3, 2)
    plane = positions(target)[read_surface(target).corner_vertex, :2].reshape(-1, 3, 2)
    own = np.repeat(islands(plane.mean(axis=1)), 3).reshape(-1, 3)
    # beside a cut a corner that lies beyond it belongs to the rim of its face's own island
    x, y = plane[..., 0], plane[..., 1]
    x = np.where(own % 2 > 0, np.maximum(x, 0.2), np.minimum(x, 0.2))
    y = np.where(own // 2 > 0, np.maximum(y, -0.1), np.minimum(y, -0.1))
    expected = laid_out(np.stack([x, y], axis=-1), own)
    size = 3 + 0.9 * 2
    off = np.linalg.norm(uv - expected, axis=2) > 0.01 * size
    with capsys.disabled():
        sys.stdout.write(f"\ncorners off by more than 1 % of the map: {off.mean():.3%}\n")
    assert off.mean() <= 0.01


def test_there_and_back_again_loses_little_and_less_on_finer_meshes(capsys: pytest.CaptureFixture[str]) -> None:
    errors = {}
    for count in (300, 1200):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        first, second = make_sheet("First", 41), remeshed("Second", 2, count)
        group = first.vertex_groups.new(name="Wave")
        wave = 0.5 + 0.5 * np.sin(4 * positions(first)[:, 0]) * np.cos(3 * positions(first)[:, 1])
        for index, value in enumerate(wave.tolist()):
            group.add((index,), value, "REPLACE")
        given = weights(first, "Wave")
        for source, target in ((first, second), (second, first)):
            settings = TransferSettings(kinds=("vertex-groups",), collisions="replace")
            plan_transfer(source, target, located(source, target), settings).write(target)
        errors[count] = np.abs(weights(first, "Wave") - given).mean()
    with capsys.disabled():
        listed = ", ".join(f"{error:.5f} by {count} points" for count, error in errors.items())
        sys.stdout.write(f"\nmean error of a weight there and back again: {listed}\n")
    assert errors[1200] < 0.5 * errors[300] < 0.02


def test_weights_that_sum_to_one_still_do_between_remeshed_copies() -> None:
    source, target = remeshed("Source", 3, 600), remeshed("Target", 4, 900)
    given = np.random.default_rng(0).dirichlet(np.ones(4), len(source.data.vertices))
    for number, column in enumerate(given.T):
        group = source.vertex_groups.new(name=f"G{number}")
        for index, value in enumerate(column.tolist()):
            group.add((index,), value, "REPLACE")
    settings = TransferSettings(kinds=("vertex-groups",), smallest_weight=0.0)
    plan_transfer(source, target, located(source, target), settings).write(target)
    total = sum(weights(target, f"G{number}") for number in range(4))
    assert np.abs(total - 1).max() < 1e-6
