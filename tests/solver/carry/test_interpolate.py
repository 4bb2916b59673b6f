import numpy as np
import pytest

from solver import Correspondence, interpolate


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
