import numpy as np
import pytest
from correspondences import on_itself, planar_correspondence, sheet

from solver import Correspondence, TriangleMesh, interpolate_corners
from solver.carry.charts import value_islands
from solver.carry.corners import CornerInterpolation


def two_charts(mesh: TriangleMesh) -> np.ndarray:
    right = mesh.vertices[mesh.faces, 0].mean(axis=1) > 0
    return mesh.vertices[mesh.faces.ravel(), :2] * 0.2 + np.repeat(np.where(right, 0.75, 0.25), 3)[:, None]


def charts_in_one_place(mesh: TriangleMesh) -> np.ndarray:
    # the right half lies turned on top of the left one, as mirrored parts of a texture do
    right = np.repeat(mesh.vertices[mesh.faces, 0].mean(axis=1) > 0, 3)
    uv = mesh.vertices[mesh.faces.ravel(), :2].copy()
    uv[right] = np.array([-0.5, 0.1]) - uv[right]
    return uv


def fan(mesh: TriangleMesh) -> np.ndarray:
    """One island with a slit along the negative x axis: the angle and the distance from a place on the axis."""
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    place = mesh.vertices[mesh.faces.ravel()] - [0.012, 0, 0]
    angle = np.arctan2(place[:, 1], place[:, 0])
    turned = np.repeat(np.sign(middle[:, 1]), 3) * angle < -np.pi / 2
    return np.stack([angle + 2 * np.pi * turned * np.repeat(np.sign(middle[:, 1]), 3), np.hypot(*place[:, :2].T)], 1)


def each_polygon_its_own(mesh: TriangleMesh) -> np.ndarray:
    return np.random.default_rng(5).random((len(mesh.faces) // 2, 1)).repeat(6, axis=0)


def test_continuous_corner_values_are_one_island_and_linear(pair):
    source, target, correspondence = pair
    uv = source.vertices[source.faces.ravel(), :2] @ np.array([[1.0, 2.0], [-1.0, 0.5]])
    assert value_islands(source.faces, uv).max() == 0
    carried = interpolate_corners(correspondence, source.vertices, uv, target.faces)
    expected = target.vertices[target.faces.ravel(), :2] @ np.array([[1.0, 2.0], [-1.0, 0.5]])
    assert carried == pytest.approx(expected, abs=1e-12)


def test_no_value_is_a_mean_of_two_islands(pair):
    source, target, correspondence = pair
    right = source.vertices[source.faces, 0].mean(axis=1) > 0
    # two charts: the left half around u = 0, the right half around u = 100
    uv = source.vertices[source.faces.ravel(), :2] + 100 * np.repeat(right, 3)[:, None]
    assert len(np.unique(value_islands(source.faces, uv))) == 2
    carried = interpolate_corners(correspondence, source.vertices, uv, target.faces)
    u = carried[:, 0].reshape(-1, 3)
    chart = u > 50
    assert (chart.all(axis=1) | ~chart.any(axis=1)).all()
    assert chart.any()
    assert not chart.all()
    true = target.vertices[target.faces, 0]
    # a corner beyond the seam takes the nearest value of its chart: off by no more than two source edges
    assert np.abs(u - 100 * chart - true).max() < 2 * source.edge_lengths.max()


@pytest.mark.parametrize("values", [two_charts, charts_in_one_place, fan, each_polygon_its_own])
@pytest.mark.parametrize("seed", range(3))
def test_onto_an_identical_mesh_every_corner_comes_back_bit_for_bit(values, seed):
    mesh, quad = sheet(21)
    given = values(mesh)
    carried = interpolate_corners(on_itself(mesh, seed), mesh.vertices, given, mesh.faces, quad)
    assert (carried == given).all()


def test_one_interpolation_carries_layers_with_the_same_and_with_other_seams():
    source, _ = sheet(20)
    target, quad = sheet(13, 14)
    found = planar_correspondence(source, target)
    carry = CornerInterpolation(found, source.vertices, target.faces, quad)
    charts = two_charts(source)
    mirrored = charts * [-1, 2]  # broken at the same sides
    for values in (charts, mirrored, fan(source), source.vertices[source.faces.ravel()], mirrored, charts):
        at_vertex, corners, beside = carry(values)
        result = at_vertex[target.faces.ravel()]
        result[corners] = beside
        assert (result == interpolate_corners(found, source.vertices, values, target.faces, quad)).all()


def test_the_triangles_of_a_group_stay_together():
    source, _ = sheet(20)
    target, quad = sheet(13, 14)
    carried = interpolate_corners(
        planar_correspondence(source, target), source.vertices, two_charts(source), target.faces, quad
    )
    right = (carried[:, 0] > 0.5).reshape(-1, 6)
    assert (right == right[:, :1]).all()
    # a polygon on one side of the seam takes that side
    x = target.vertices[target.faces, 0].reshape(-1, 6)
    assert right[x.min(axis=1) > 0.06].all()
    assert not right[x.max(axis=1) < -0.06].any()


@pytest.mark.parametrize("n", [7, 12, 33])
def test_no_triangle_is_stretched_across_a_slit(n):
    source, _ = sheet(41)
    target, quad = sheet(n, n + 1)
    carried = interpolate_corners(
        planar_correspondence(source, target), source.vertices, fan(source), target.faces, quad
    )
    angle = carried[:, 0].reshape(-1, 6)
    x, y = np.moveaxis(target.vertices[target.faces].reshape(-1, 6, 3), 2, 0)[:2]
    away = (x.max(axis=1) < -0.3) | (x.min(axis=1) > 0.3) | (np.abs(y).min(axis=1) > 0.3)
    assert away.sum() > 0.5 * len(away)
    # seen from the tip a polygon that far away covers no more than this; across the slit it would be 2 pi
    assert np.ptp(angle[away], axis=1).max() < 1.3
    true = np.arctan2(y, x - 0.012)
    apart = (np.abs(y).min(axis=1) > 0.06) & (np.abs(np.sign(y).sum(axis=1)) == 6)
    assert np.abs(np.angle(np.exp(1j * (angle - true))))[away & apart].max() < 0.02


def test_a_corner_without_counterpart_does_not_choose_the_side():
    mesh, quad = sheet(21)
    whole = on_itself(mesh, 0)
    face, barycentric = whole.face.copy(), whole.barycentric.copy()
    bare = np.random.default_rng(0).choice(len(face), 40, replace=False)
    face[bare], barycentric[bare] = -1, 0
    part = Correspondence(face, barycentric, whole.matched, whole.confidence, mesh.faces, len(mesh.vertices))
    given = two_charts(mesh)
    carried = interpolate_corners(part, mesh.vertices, given, mesh.faces, quad)
    gone = np.isin(mesh.faces.ravel(), bare)
    assert (carried[gone] == 0).all()
    whole_quads = np.repeat(~gone.reshape(-1, 6).any(axis=1), 6)
    assert (carried[whole_quads] == given[whole_quads]).all()
