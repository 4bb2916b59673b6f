"""Values at points inside triangles."""

import numpy as np

from solver.surface.barycentric import interpolated, weighted


def test_linear_values_stay_linear() -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(9, 3))
    corners, weights = rng.integers(0, 9, (20, 3)), rng.dirichlet(np.ones(3), 20)
    normal, frames = rng.normal(size=3), rng.normal(size=(3, 2, 2))
    points = interpolated(places, corners, weights)
    assert points.shape == (20, 3)
    np.testing.assert_allclose(interpolated(places @ normal, corners, weights), points @ normal)
    by_frames = np.einsum("nk,kab->nab", places, frames)
    np.testing.assert_allclose(interpolated(by_frames, corners, weights), np.einsum("nk,kab->nab", points, frames))


def test_a_corner_has_its_own_value() -> None:
    values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    assert weighted(values, np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])).tolist() == [2.0, 6.0]
    halfway = interpolated(np.array([1.0, 3.0]), np.array([[0, 1]]), np.array([[0.5, 0.5]]))
    assert halfway.tolist() == [2.0]
