import numpy as np
import pytest
from surfaces import planar, rings

from solver import Correspondence, TriangleMesh, interpolate, interpolate_corners
from solver.interpolate import value_islands
from solver.locate import TriangulatedDisc


def planar_correspondence(source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """The correspondence of two triangulations of one plane region: each point to itself."""
    plane = [mesh.vertices[:, 0] + 1j * mesh.vertices[:, 1] for mesh in (source, target)]
    face, barycentric = TriangulatedDisc.of(plane[0], source.faces).locate(plane[1])
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), source.faces, len(source.vertices))


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh, Correspondence]:
    source, target = planar(rings(12, jitter=0.4, seed=1)), planar(0.9 * rings(9, jitter=0.4, seed=2))
    return source, target, planar_correspondence(source, target)


def test_a_linear_function_is_exact(pair):
    source, target, correspondence = pair
    coefficients = np.array([[2.0, -1.0], [0.5, 3.0], [0.0, 0.0]])
    carried = interpolate(correspondence, source.vertices @ coefficients + 7)
    assert carried == pytest.approx(target.vertices @ coefficients + 7, abs=1e-12)


def test_weights_stay_a_partition_of_unity(pair):
    source, _, correspondence = pair
    weights = np.random.default_rng(0).dirichlet([1, 1, 1, 1], len(source.vertices))
    carried = interpolate(correspondence, weights)
    assert carried.min() >= 0
    assert carried.sum(axis=1) == pytest.approx(1)


def test_a_vertex_without_counterpart_gets_nothing(pair):
    source, _, whole = pair
    face, barycentric = whole.face.copy(), whole.barycentric.copy()
    face[3], barycentric[3] = -1, 0
    part = Correspondence(face, barycentric, whole.matched, whole.confidence, source.faces, len(source.vertices))
    carried = interpolate(part, np.ones(len(source.vertices)))
    assert carried[3] == 0
    assert np.delete(carried, 3) == pytest.approx(1)


def test_the_wrong_number_of_values_is_refused(pair):
    with pytest.raises(ValueError, match="5 values do not fit"):
        interpolate(pair[2], np.zeros(5))


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


def test_islands_are_those_of_a_walk_over_equal_sides():
    mesh = planar(rings(4))
    uv = np.random.default_rng(0).integers(0, 2, (3 * len(mesh.faces), 1)).astype(float)
    label = value_islands(mesh.faces, uv)
    values = uv.reshape(-1, 3)
    for f in range(len(mesh.faces)):
        for g in range(f):
            shared = set(mesh.faces[f]) & set(mesh.faces[g])
            if len(shared) == 2 and all(
                values[f][list(mesh.faces[f]).index(v)] == values[g][list(mesh.faces[g]).index(v)] for v in shared
            ):
                assert label[f] == label[g]
