import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from surfaces import largest_error, planar, rectangle_to_disc, rings

from solver import MeshError, TriangleMesh, flatten, topology
from solver.flatten.circle_packing import _layout, packing_radii, silhouette_mesh
from solver.flatten.distortion import signed_areas

SHAPES = ["car-01", "car-02", "device0-1", "face-1", "hammer-1", "Heart-1", "rat-01"]


def round_shape(radius: int = 90) -> np.ndarray:
    y, x = np.mgrid[: 2 * radius + 10, : 2 * radius + 10] - radius - 4.5
    return x**2 + y**2 < radius**2


def boundary_mask(mesh: TriangleMesh) -> np.ndarray:
    return np.isin(np.arange(len(mesh.vertices)), topology(mesh).boundary_loops[0])


def tangency_error(mesh: TriangleMesh) -> float:
    """Largest error of a hyperbolic distance between neighbours, as tanh of half of it, against the sum of radii."""
    rim = boundary_mask(mesh)
    y = packing_radii(mesh.faces, rim)
    centres = _layout(mesh.faces, y, rim)
    i, j = mesh.edges[~rim[mesh.edges].any(axis=1)].T
    apart = np.abs(centres[i] - centres[j]) / np.abs(1 - np.conj(centres[i]) * centres[j])
    shrunk = np.sqrt(y[i] * y[j])
    assert (signed_areas(centres, mesh.faces) > 0).all()
    assert np.abs(np.abs(centres[rim]) - 1).max() < 1e-9
    return float(np.abs(apart - (1 - shrunk) / (1 + shrunk)).max())


@pytest.mark.parametrize("circles", [100, 1000, 6000])
def test_all_neighbours_are_tangent(circles):
    assert tangency_error(silhouette_mesh(round_shape(), circles)) < 1e-7


def test_any_triangulation_is_packed():
    assert tangency_error(planar(rings(12, jitter=0.4))) < 1e-7


def test_seven_circles():
    around = np.exp(1j * np.pi / 3 * np.arange(6))
    mesh = planar(np.concatenate([[0], around]))
    y = packing_radii(mesh.faces, boundary_mask(mesh))
    # six horocycles around one circle: sin(pi / 6) = exp(-r)
    assert y == pytest.approx([0.25, 0, 0, 0, 0, 0, 0])
    disc = flatten(mesh, "circle-packing").disc
    assert np.abs(disc[0]) < 1e-9
    assert disc[1:] / disc[1] == pytest.approx(around / around[0])


def test_the_packing_of_a_round_shape_tends_to_the_identity():
    errors = []
    for circles in (100, 400, 1600, 6400):
        mesh = silhouette_mesh(round_shape(200), circles)
        disc = flatten(mesh, "circle-packing").disc
        points = mesh.vertices @ [1, 1j, 0]
        points -= np.average(points, weights=mesh.vertex_areas)
        turn = np.vdot(disc, points)
        errors.append(float(np.median(np.abs(disc * turn / abs(turn) - points / 200))))
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert errors[3] < 0.02


def test_the_packing_of_a_square_tends_to_its_riemann_map():
    mesh = silhouette_mesh(np.ones((240, 240), bool), 8000)
    points = (mesh.vertices - [120, 120, 0]) @ [1, 1j, 0] / 120 * 0.999
    truth = rectangle_to_disc(points, 1)
    assert largest_error(flatten(mesh, "circle-packing").disc, truth / np.maximum(np.abs(truth), 1), mesh) < 0.12
    median = np.median(np.abs(flatten(mesh, "circle-packing").disc) - np.abs(truth))
    assert abs(median) < 0.01


@pytest.mark.parametrize("name", SHAPES)
def test_silhouettes_become_discs_and_are_packed(silhouette, name):
    mesh = silhouette_mesh(silhouette(f"{name}.gif"), 1500, name)
    assert topology(mesh).is_disc
    assert np.ptp(mesh.edge_lengths) < 1e-9 * mesh.edge_lengths.max()
    assert (mesh.face_vectors[:, 2] > 0).all()
    flattening = flatten(mesh, "circle-packing")
    assert flattening.distortion.flips == 0
    assert np.abs(flattening.disc[flattening.boundary]) == pytest.approx(np.ones(len(flattening.boundary)))


def test_the_car_packed_agrees_with_its_harmonic_map(silhouette):
    mesh = silhouette_mesh(silhouette("car-01.gif"), 3000, "car-01")
    packed, harmonic = flatten(mesh, "circle-packing").disc, flatten(mesh).disc
    turn = np.vdot(packed, mesh.vertex_areas * harmonic)
    assert np.median(np.abs(packed * turn / abs(turn) - harmonic)) < 0.03


@pytest.mark.parametrize("seed", range(30))
def test_shapes_with_holes_and_pinches_become_discs(seed):
    noise = gaussian_filter(np.random.default_rng(seed).standard_normal((120, 150)), 4)
    assert topology(silhouette_mesh(noise > np.quantile(noise, 0.4), 800)).is_disc


def test_an_empty_or_too_thin_silhouette_is_refused():
    with pytest.raises(ValueError, match="empty"):
        silhouette_mesh(np.zeros((9, 9), bool))
    with pytest.raises(ValueError, match="more circles"):
        silhouette_mesh(np.ones((1, 50), bool), 20)


def test_a_mesh_with_an_edge_across_is_refused():
    square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], "Scan")
    with pytest.raises(MeshError, match=r"^'Scan' is too coarse for the method 'circle-packing'"):
        flatten(square, "circle-packing")
