import numpy as np
import pytest
from surfaces import largest_error, planar, rings, spherical_cap

from solver import MeshError, Mobius, TriangleMesh, flatten
from solver.mobius import conformal_barycentre


def test_a_planar_disc_stays_what_it_is():
    points = rings(24, jitter=0.3)
    mesh = planar(points)
    flattening = flatten(mesh)
    assert largest_error(flattening.disc, points, mesh) < 2e-3
    assert flattening.distortion.flips == 0


def test_a_disc_moved_by_a_mobius_transformation_comes_back():
    points = Mobius(0.4 + 0.2j, 1.0)(rings(30))
    mesh = planar(points)
    assert largest_error(flatten(mesh).disc, points, mesh) < 4e-3


@pytest.mark.parametrize("polar_angle", [0.5, 1.5, 2.5])
def test_a_spherical_cap_is_projected_stereographically(polar_angle):
    mesh, truth = spherical_cap(40, polar_angle, jitter=0.2)
    assert largest_error(flatten(mesh).disc, truth, mesh) < 5e-3


def test_the_boundary_is_on_the_circle_in_order():
    mesh, _ = spherical_cap(20, 2.0)
    flattening = flatten(mesh)
    rim = flattening.disc[flattening.boundary]
    assert np.abs(np.abs(rim) - 1).max() < 1e-15
    gaps = np.angle(np.roll(rim, -1) / rim)
    assert gaps.min() > 0
    assert gaps.sum() == pytest.approx(2 * np.pi)
    interior = np.setdiff1d(np.arange(len(mesh.vertices)), flattening.boundary)
    assert np.abs(flattening.disc[interior]).max() < 1


def test_it_is_centred():
    mesh, _ = spherical_cap(12, 1.0)
    lopsided = TriangleMesh(mesh.vertices * [1, 2, 0.5] + [0, 0, 3], mesh.faces)
    disc = flatten(lopsided).disc
    assert abs(conformal_barycentre(disc, lopsided.vertex_areas)) < 1e-9


def test_loose_vertices_have_no_image():
    mesh, _ = spherical_cap(6, 1.0)
    loose = TriangleMesh(np.concatenate([[[9, 9, 9]], mesh.vertices]), mesh.faces + 1)
    disc = flatten(loose).disc
    assert np.isnan(disc[0])
    assert disc[1:] == pytest.approx(flatten(mesh).disc, abs=1e-12)


def test_what_is_no_disc_is_refused():
    closed = TriangleMesh(np.eye(4)[:, :3], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], "Scan")
    with pytest.raises(MeshError, match=r"^'Scan' is closed"):
        flatten(closed)
    with pytest.raises(ValueError, match="'conformal'"):
        flatten(planar(rings(3)), "conformal")
