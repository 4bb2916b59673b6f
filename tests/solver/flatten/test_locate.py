import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from surfaces import planar, rings

from solver import flatten
from solver.flatten.locate import TriangulatedDisc
from solver.surface.mesh import face_neighbours


def disc_points(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))


@given(seed=st.integers(0, 10_000), count=st.integers(2, 12))
def test_a_point_made_in_a_triangle_is_found_there(seed, count):
    rng = np.random.default_rng(seed)
    points = rings(count, jitter=0.4, seed=seed)
    faces = planar(points).faces
    face, weights = rng.integers(len(faces), size=50), rng.dirichlet([1, 1, 1], 50)
    found, barycentric = TriangulatedDisc.of(points, faces).locate((points[faces[face]] * weights).sum(axis=1))
    clear = weights.min(axis=1) > 1e-9
    assert (found[clear] == face[clear]).all()
    assert barycentric == pytest.approx(weights, abs=1e-9)


def test_against_trying_every_triangle():
    points = rings(6, jitter=0.4)
    faces = planar(points).faces
    disc = TriangulatedDisc.of(points, faces)
    queries = disc_points(300, 1)
    found, _ = disc.locate(queries)
    every = np.stack([disc.barycentric(np.full(len(queries), f), queries).min(axis=1) for f in range(len(faces))])
    inside = every.max(axis=0) > 1e-9
    assert inside.mean() > 0.9
    assert (found[inside] == every.argmax(axis=0)[inside]).all()


def test_beyond_the_polygon_the_nearest_point_of_the_boundary():
    points = rings(2)
    faces = planar(points).faces
    around = np.exp(2j * np.pi * np.arange(360) / 360)
    disc = TriangulatedDisc.of(points, faces)
    face, barycentric = disc.locate(around)
    place = (points[faces[face]] * barycentric).sum(axis=1)
    rim = points[np.abs(points) > 1 - 1e-9]
    rim = rim[np.argsort(np.angle(rim))]
    along = np.linspace(0, 1, 2001)
    polygon = (rim[:, None] * (1 - along) + np.roll(rim, -1)[:, None] * along).ravel()
    nearest = np.abs(around[:, None] - polygon).min(axis=1)
    assert np.abs(place - around) == pytest.approx(nearest, abs=1e-3)
    assert barycentric.min() >= 0
    assert barycentric.sum(axis=1) == pytest.approx(1)


def test_on_a_real_disc_every_vertex_finds_itself(real_mesh):
    mesh = real_mesh("teeth/K04.obj")
    disc = flatten(mesh).disc
    face, barycentric = TriangulatedDisc.of(disc, mesh.faces).locate(disc)
    place = np.einsum("qk,qkd->qd", barycentric, mesh.vertices[mesh.faces[face]])
    assert np.linalg.norm(place - mesh.vertices, axis=1).max() < 1e-4 * mesh.diagonal


def test_neighbours_share_the_side_opposite_the_corner():
    faces = planar(rings(5)).faces
    neighbours = face_neighbours(faces, faces.max() + 1)
    for f, k in zip(*np.nonzero(neighbours >= 0), strict=True):
        assert set(np.delete(faces[f], k)) < set(faces[neighbours[f, k]])
    boundary = (neighbours < 0).sum()
    assert boundary == 30  # the outermost of five rings


def test_a_place_is_the_same_to_the_last_bit_whatever_lies_beside_it_in_memory():
    rng = np.random.default_rng(3)
    points = rings(20, jitter=0.4, seed=3)
    faces = planar(points).faces
    queries = 0.9 * np.sqrt(rng.random(200)) * np.exp(2j * np.pi * rng.random(200))
    disc = TriangulatedDisc.of(points, faces)
    first = disc.locate(queries)
    for _ in range(300):
        _held = [np.empty(size, np.uint8) for size in rng.integers(1, 20_000, 20)]
        face, barycentric = disc.locate(queries.copy())
        assert (face == first[0]).all()
        assert barycentric.tobytes() == first[1].tobytes()
