import numpy as np
import pytest
from scans import bumps

from solver import flatten
from solver.surface_points import SurfacePoints, nearest_in_triangle


@pytest.fixture(scope="module")
def surface():
    flattening = flatten(bumps(600, seed=2))
    return SurfacePoints(flattening.mesh, (flattening.boundary,), 0.03)


def test_nearest_in_triangle_against_a_fine_grid():
    rng = np.random.default_rng(0)
    corners, points = rng.normal(size=(50, 3, 3)), 1.5 * rng.normal(size=(50, 3))
    corners[7, 2] = corners[7, 1]  # no area
    corners[8] = corners[8, 0]  # a point
    steps = np.linspace(0, 1, 200)
    grid = np.array([(1 - v - w, v, w) for v in steps for w in steps if v + w <= 1 + 1e-12])
    weights = nearest_in_triangle(points, corners)
    assert weights.min() >= 0
    assert weights.sum(axis=1) == pytest.approx(1)
    for k in range(len(points)):
        found = np.linalg.norm(weights[k] @ corners[k] - points[k])
        best = np.linalg.norm(grid @ corners[k] - points[k], axis=1).min()
        assert best - 0.05 <= found <= best + 1e-9


def test_points_lifted_off_the_surface_come_back(surface):
    mesh = surface.mesh
    rng = np.random.default_rng(1)
    face = rng.integers(0, len(mesh.faces), 300)
    weights = rng.dirichlet(np.ones(3), 300)
    there = np.einsum("qk,qkd->qd", weights, mesh.vertices[mesh.faces[face]])
    normal = mesh.face_vectors[face] / np.linalg.norm(mesh.face_vectors[face], axis=1, keepdims=True)
    found, barycentric = surface.nearest_point(there + 1e-3 * normal, normal)
    place = np.einsum("qk,qkd->qd", barycentric, mesh.vertices[mesh.faces[found]])
    assert np.linalg.norm(place - there, axis=1).max() < 1e-3


def test_normals_tell_two_sheets_apart():
    """Of two parallel sheets the one that faces the same way is taken, though the other is nearer."""
    flattening = flatten(bumps(200, seed=0))
    down = SurfacePoints(flattening.mesh, (flattening.boundary,), 10.0)
    at, normal, _ = down.nearest_sample(np.array([[0.0, 0, 5]]), np.array([[0.0, 0, 1]]))
    assert normal[0, 2] > 0.95
    assert at.shape == (1, 3)


def test_nearest_on_the_boundary(surface):
    mesh, loop = surface.mesh, surface.loops[0]
    start, stop = mesh.vertices[loop], mesh.vertices[np.roll(loop, -1)]
    middle = 0.37 * stop + 0.63 * start
    at, tangent = surface.nearest_on_boundary(middle)
    assert at == pytest.approx(middle, abs=1e-3)
    assert np.abs((tangent * (stop - start)).sum(axis=1)) == pytest.approx(
        np.linalg.norm(stop - start, axis=1), rel=0.1
    )


def test_boundary_samples_are_named(surface):
    mesh, loop = surface.mesh, surface.loops[0]
    normals = mesh.vertex_normals()
    assert surface.nearest_sample(mesh.vertices[loop], normals[loop])[2].all()
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), loop)
    assert not surface.nearest_sample(mesh.vertices[inner], normals[inner])[2].any()
