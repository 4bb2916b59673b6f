"""Filling the part of a surface that has no values: the nearest along the surface, and harmonic functions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Correspondence, TriangleMesh
from solver.carry.fill import HarmonicFill, nearest_known, with_nearest, without


def sheet(n: int, height=lambda x, y: 0 * x) -> TriangleMesh:
    side = np.linspace(-1, 1, n)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (k.ravel() for k in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return TriangleMesh(np.stack([x, y, height(x, y)], 1), faces)


def gap(mesh: TriangleMesh, radius: float = 0.5) -> np.ndarray:
    return np.linalg.norm(mesh.vertices[:, :2] - [0.1, -0.1], axis=1) > radius


def test_a_harmonic_function_is_filled_as_it_is():
    mesh = sheet(21)
    known = gap(mesh)
    x, y, _ = mesh.vertices.T
    values = np.stack([x, 1 - 2 * y, x * y], axis=1)
    filled = HarmonicFill.of(mesh, known)(np.where(known[:, None], values, 99.0))
    # x y is harmonic for the five-point stencil too, which the cotangent Laplacian of this sheet is; only the weights
    # of the diagonals, zero, are raised to a millionth
    assert np.abs(filled - values).max() < 1e-5
    assert (filled[known] == values[known]).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_filled_values_stay_within_the_known_ones_and_weights_keep_their_sum(seed):
    rng = np.random.default_rng(seed)
    mesh = sheet(9, lambda x, y: rng.normal(0, 0.5, len(x)))  # rough: many obtuse angles
    known = rng.random(81) < 0.3
    known[0] = True
    weights = rng.dirichlet(np.ones(4), 81)
    fill = HarmonicFill.of(mesh, known)
    filled = fill(weights)
    assert fill.reached.all()
    assert filled.min() >= weights[known].min() - 1e-9
    assert filled.max() <= weights[known].max() + 1e-9
    assert np.abs(filled.sum(axis=1) - 1).max() < 1e-9


def test_a_part_that_does_not_hang_together_with_known_ones_is_left():
    one = sheet(4)
    mesh = TriangleMesh(
        np.concatenate([one.vertices, one.vertices + np.array([5, 0, 0])]), np.concatenate([one.faces, one.faces + 16])
    )
    known = np.zeros(32, bool)
    known[3] = True
    fill = HarmonicFill.of(mesh, known)
    filled = fill(np.full(32, 7.0))
    assert fill.reached.tolist() == [True] * 16 + [False] * 16
    assert filled == pytest.approx(7.0)
    # while the nearest is found across the gap
    assert (nearest_known(mesh, known) == 3).all()


def test_the_nearest_is_nearest_along_the_surface():
    # a long strip bent to a horseshoe, its ends beside each other
    turn = np.linspace(0.05, 2 * np.pi - 0.05, 40)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    vertices = np.concatenate([ring, 1.2 * ring])
    i = np.arange(39)
    faces = np.concatenate([np.stack([i, i + 40, i + 41], 1), np.stack([i, i + 41, i + 1], 1)])
    known = np.zeros(80, bool)
    known[[0, 40, 20, 60]] = True
    nearest = nearest_known(TriangleMesh(vertices, faces), known)
    assert np.isin(nearest[[39, 79]], [20, 60]).all()  # not 0 and 40, which lie next to them in space
    assert (nearest[known] == np.flatnonzero(known)).all()


def test_against_every_path():
    mesh = sheet(7, lambda x, y: x**2)
    known = np.zeros(49, bool)
    known[[0, 17, 30, 45]] = True
    distance = np.full((49, 49), np.inf)
    low, high = mesh.edges.T
    distance[low, high] = distance[high, low] = np.linalg.norm(mesh.vertices[low] - mesh.vertices[high], axis=1)
    np.fill_diagonal(distance, 0)
    for k in range(49):
        distance = np.minimum(distance, distance[:, [k]] + distance[[k]])
    nearest = nearest_known(mesh, known)
    assert known[nearest].all()
    assert distance[np.arange(49), nearest] == pytest.approx(distance[:, known].min(axis=1))


def test_nothing_known():
    mesh = sheet(4)
    none = np.zeros(16, bool)
    assert (nearest_known(mesh, none) == -1).all()
    fill = HarmonicFill.of(mesh, none)
    assert not fill.reached.any()
    assert (fill(np.ones(16)) == 1).all()


def test_counterparts_taken_away_and_given_again():
    mesh = sheet(4)
    face = np.zeros(16, int)
    face[mesh.faces.ravel()] = np.arange(mesh.faces.size) // 3
    barycentric = (mesh.faces[face] == np.arange(16)[:, None]).astype(float)
    found = Correspondence(face, barycentric, np.ones(16, bool), np.ones(16), mesh.faces, 16)
    excluded = np.arange(16) == 5
    bare = without(found, excluded)
    assert bare.face[5] == -1
    assert not bare.matched[5]
    assert bare.matrix().toarray()[5].tolist() == [0.0] * 16
    nearest = nearest_known(mesh, bare.face >= 0)
    again = with_nearest(bare, nearest)
    assert again.matrix().toarray()[5].argmax() == nearest[5]
    assert (again.matrix().toarray()[~excluded] == np.eye(16)[~excluded]).all()
