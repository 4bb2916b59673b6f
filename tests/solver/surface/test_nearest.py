import time

import numpy as np
import pytest
from scans import bumps
from scipy.spatial import KDTree

from solver import TriangleMesh, flatten
from solver.surface import nearest
from solver.surface.nearest import SurfacePoints, in_turn, nearest_in_triangle


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
    mesh = flattening.mesh
    high = mesh.vertices + np.array([0, 0, 0.5])
    faces = np.vstack([mesh.faces, mesh.faces[:, ::-1] + len(high)])
    both = SurfacePoints(TriangleMesh(np.vstack([mesh.vertices, high]), faces), (flattening.boundary,), 1.0)
    above, up = np.array([[0.1, 0.1, 1.0]]), np.array([[0.0, 0, 1]])
    low_place, low_normal, _ = both.at(*both.most_alike(above, up))
    high_place, high_normal, _ = both.at(*both.most_alike(above, -up))
    assert high_place[0, 2] - low_place[0, 2] == pytest.approx(0.5, abs=0.1)
    assert low_normal[0, 2] > 0.9
    assert high_normal[0, 2] < -0.9


def test_the_point_most_alike_is_the_best_of_a_fine_grid(surface):
    """In position and normal together, to within the grid."""
    mesh, weight = surface.mesh, surface.normal_weight
    normals = mesh.vertex_normals()
    rng = np.random.default_rng(2)
    steps = np.linspace(0, 1, 15)
    grid = np.array([(1 - v - w, v, w) for v in steps for w in steps if v + w <= 1 + 1e-12])
    features = np.hstack([mesh.vertices, weight * normals])
    everywhere = np.einsum("gk,mkd->mgd", grid, features[mesh.faces]).reshape(-1, 6)
    query = everywhere[rng.integers(0, len(everywhere), 200)] + 0.02 * rng.normal(size=(200, 6))
    query[:, 3:] *= weight / np.linalg.norm(query[:, 3:], axis=1, keepdims=True)
    position, normal, _ = surface.at(*surface.most_alike(query[:, :3], query[:, 3:] / weight))
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1)
    apart = np.linalg.norm(np.hstack([position, weight * normal]) - query, axis=1)
    assert (apart <= KDTree(everywhere).query(query)[0] + 1e-3).mean() > 0.97


def test_nearest_on_the_boundary(surface):
    mesh, loop = surface.mesh, surface.loops[0]
    start, stop = mesh.vertices[loop], mesh.vertices[np.roll(loop, -1)]
    middle = 0.37 * stop + 0.63 * start
    at, tangent = surface.nearest_on_boundary(middle)
    assert at == pytest.approx(middle, abs=1e-3)
    assert np.abs((tangent * (stop - start)).sum(axis=1)) == pytest.approx(
        np.linalg.norm(stop - start, axis=1), rel=0.1
    )


def test_points_on_a_boundary_are_named(surface):
    mesh, loop = surface.mesh, surface.loops[0]
    normals = mesh.vertex_normals()
    outside = mesh.vertices[loop] * np.array([1.2, 1.2, 1])
    assert surface.at(*surface.most_alike(outside, normals[loop]))[2].mean() > 0.95
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), loop)
    assert not surface.at(*surface.most_alike(mesh.vertices[inner], normals[inner]))[2].any()


def test_of_no_points_none_is_nearest(surface):
    """As where parts that ride along share all their vertices with others."""
    face, weights = surface.nearest_point(np.empty((0, 3)), np.empty((0, 3)))
    assert face.shape == (0,)
    assert weights.shape == (0, 3)


def test_many_queries_are_answered_alike_on_several_processors(surface, monkeypatch):
    rng = np.random.default_rng(5)
    points, normals = rng.normal(size=(500, 3)) / 3, rng.normal(size=(500, 3))
    plain = surface.nearest_point(points, normals)
    monkeypatch.setattr(nearest, "AT_ONCE", 7)
    monkeypatch.setattr(nearest, "ASKED_AT_ONCE", 50)
    told: list[float] = []
    found = surface.nearest_point(points, normals, progress=told.append)
    assert all((one == two).all() for one, two in zip(plain, found, strict=True))
    assert len(told) == 10 + -(-500 // 7)
    assert told == sorted(told)


def test_work_in_turn_ends_when_it_is_told_to():
    done: list[int] = []

    def stop(share: float) -> None:
        if share > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        in_turn(lambda number: (time.sleep(0.002), done.append(number)), range(1000), stop)
    assert 100 <= len(done) < 500

    def wrong(number: int) -> None:
        raise ValueError(number)

    with pytest.raises(ValueError, match="0"):
        in_turn(wrong, range(50), None)
