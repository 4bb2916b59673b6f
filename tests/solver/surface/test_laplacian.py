import numpy as np
import pytest
from surfaces import planar, rings, spherical_cap

from solver import TriangleMesh
from solver.surface.laplacian import cotangents, laplacian, mollified_lengths


def test_cotangents_of_a_right_triangle():
    assert cotangents(np.array([[5.0, 4.0, 3.0]])) == pytest.approx(np.array([[0, 3 / 4, 4 / 3]]))


def test_cotangents_of_a_needle_keep_their_digits():
    width = 1e-7
    long = np.hypot(1, width / 2)
    found = cotangents(np.array([[width, long, long]]))
    assert found[0, 0] == pytest.approx(2 / width / 2, rel=1e-3)
    assert found[0, 1] == pytest.approx(width / 2, rel=1e-3)


def test_linear_functions_are_harmonic_in_the_plane():
    points = rings(9, jitter=0.4)
    matrix = laplacian(planar(points))
    inner = np.abs(points) < 1 - 1e-9
    assert np.abs(matrix @ points.real)[inner].max() < 1e-12
    assert points.real @ matrix @ points.real == pytest.approx(planar(points).area)


def test_it_is_symmetric_with_rows_of_sum_zero_and_positive():
    matrix = laplacian(spherical_cap(6, 1.5, jitter=0.3)[0]).toarray()
    assert matrix == pytest.approx(matrix.T)
    assert matrix.sum(axis=1) == pytest.approx(np.zeros(len(matrix)), abs=1e-12)
    assert np.linalg.eigvalsh(matrix)[1] > 1e-3


def test_the_energy_of_the_height_on_a_sphere():
    mesh, _ = spherical_cap(60, np.pi / 2)
    height = mesh.vertices[:, 2]
    # |grad z|^2 = 1 - z^2 over the half sphere: 2 pi (1 - 1/3)
    assert height @ laplacian(mesh) @ height == pytest.approx(4 * np.pi / 3, rel=2e-3)


def test_masses_sum_to_the_area():
    mesh, _ = spherical_cap(6, 1.5)
    assert mesh.vertex_areas.sum() == pytest.approx(mesh.area)


def test_only_lengths_that_lack_area_grow():
    clean = spherical_cap(6, 1.5)[0].edge_lengths
    assert (mollified_lengths(clean) == clean).all()
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], [[0, 1, 3], [1, 2, 3], [0, 2, 1]]).edge_lengths
    grown = mollified_lengths(flat)
    assert 0 < (grown - flat).max() < 1e-5
    assert np.ptp(grown - flat) < 1e-12
    assert (2 * grown.max(axis=1) < grown.sum(axis=1)).all()
