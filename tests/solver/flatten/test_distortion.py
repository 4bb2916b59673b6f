import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surfaces import planar, rings, spherical_cap

from solver import Mobius, TriangleMesh, flatten, topology
from solver.flatten.distortion import angle_errors, dilatations, distortion, log_conformal_factor, vertex_angle_errors


def measured(mesh: TriangleMesh, plane: np.ndarray):
    return distortion(mesh, plane, topology(mesh).boundary_loops[0])


def test_a_similarity_has_none():
    points = rings(9, jitter=0.3)
    found = measured(planar(points), 3j * points + 2)
    assert found.max_angle_error < 1e-5
    assert found.max_dilatation == pytest.approx(1)
    assert found.min_log_factor == pytest.approx(0, abs=1e-9)
    assert found.max_log_factor == pytest.approx(0, abs=1e-9)
    assert found.flips == 0
    assert found.circularity == pytest.approx(np.pi / 54 / np.tan(np.pi / 54))


@pytest.mark.parametrize("stretch", [1.5, 4, 20])
def test_an_affine_map_has_its_ratio_of_stretches_as_dilatation(stretch):
    points = rings(9, jitter=0.3)
    plane = np.exp(0.4j) * (points * np.exp(1j)).real * stretch + 1j * np.exp(0.4j) * (points * np.exp(1j)).imag
    assert dilatations(planar(points), plane) == pytest.approx(np.full(len(planar(points).faces), stretch))


def test_a_map_into_space_is_measured_like_one_into_the_plane():
    points = rings(9, jitter=0.3)
    mesh, plane = planar(points), 2 * points.real + 1j * points.imag
    turn = Rotation.from_rotvec((0.4, -1.0, 2.0)).as_matrix()
    space = np.stack([plane.real, plane.imag, np.zeros(len(plane))], axis=1) @ turn.T + (1, 2, 3)
    assert dilatations(mesh, space) == pytest.approx(dilatations(mesh, plane))
    assert log_conformal_factor(mesh, space) == pytest.approx(log_conformal_factor(mesh, plane))
    # in space a triangle that is turned over is like any other
    assert dilatations(mesh, space * (-1, 1, 1)) == pytest.approx(2)


def test_angles_of_one_triangle():
    mesh = TriangleMesh([[0, 0, 5], [3, 0, 5], [0, 3, 5]], [[0, 1, 2]])
    plane = np.array([0, 1, np.exp(1j * np.pi / 3)])
    assert angle_errors(mesh, plane) == pytest.approx(np.array([[30, 15, 15]]))
    assert vertex_angle_errors(mesh, plane) == pytest.approx([30, 15, 15])
    found = measured(mesh, plane)
    assert (found.mean_angle_error, found.median_angle_error, found.max_angle_error) == pytest.approx((20, 15, 30))


def test_a_mirror_turns_every_triangle():
    points = rings(3)
    mesh = planar(points)
    assert measured(mesh, points.conj()).flips == len(mesh.faces)
    assert np.isinf(dilatations(mesh, points.conj())).all()
    assert measured(mesh, points.conj()).max_dilatation == 1


def test_the_conformal_factor_of_a_cap_is_that_of_stereographic_projection():
    polar_angle = 2.0
    mesh, truth = spherical_cap(60, polar_angle)
    found = measured(mesh, truth)
    # |d tan(t/2)| / |dt| = 1 / (2 cos^2(t/2)): from pole to rim a factor of 1 / cos^2
    assert found.max_log_factor - found.min_log_factor == pytest.approx(-2 * np.log(np.cos(polar_angle / 2)), rel=0.03)
    assert found.mean_dilatation < 1.02


def test_it_does_not_depend_on_scale_pose_or_loose_vertices():
    mesh, _ = spherical_cap(10, 1.3, jitter=0.3)
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    moved = TriangleMesh(np.concatenate([1e3 * mesh.vertices @ turn.T + 7, [[9, 9, 9]]]), mesh.faces)
    one, other = flatten(mesh).distortion, flatten(moved).distortion
    assert list(vars(one).values()) == pytest.approx(list(vars(other).values()), rel=1e-4, abs=1e-6)


def test_a_face_without_area_does_not_spoil_the_figures():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], float)
    mesh = TriangleMesh(vertices, [[0, 1, 3], [1, 2, 3], [0, 2, 1]])
    found = flatten(mesh).distortion
    assert all(np.isfinite(list(vars(found).values())))
    assert found.flips == 0


def test_a_mobius_transformation_changes_it_by_little():
    points = rings(50)
    found = measured(planar(points), Mobius(0.4j, 1)(points))
    assert found.mean_angle_error < 1
    assert found.circularity > 0.99
