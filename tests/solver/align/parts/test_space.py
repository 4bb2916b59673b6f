"""The map of space around surfaces: a similarity where there is one, and smooth where there is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import similarity

from solver.align.parts.space import SpaceMap


def random_map(seed: int, mirror: bool) -> tuple[SpaceMap, float, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    scale, turn, shift = similarity(rng)
    turn = turn * (-1 if mirror else 1)
    here = rng.normal(size=(50, 3)) + rng.normal(size=3)
    there = scale * here @ turn.T + shift
    return SpaceMap(here, there, rng.random(50) + 0.1, rng.random(50), mirror), scale, turn, shift


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_a_similarity_is_found_anywhere(seed: int, mirror: bool) -> None:
    space, scale, turn, shift = random_map(seed, mirror)
    places = 10 * np.random.default_rng(seed + 1).normal(size=(100, 3))
    found = space.at(places, np.full(100, 0.1))
    assert np.allclose(found(places), scale * places @ turn.T + shift, atol=1e-6 * scale * 10)
    assert np.allclose(found.turn, turn, atol=1e-6)
    assert np.allclose(found.scale, scale)
    assert np.allclose(found.only(3, places), scale * places @ turn.T + shift, atol=1e-6 * scale * 10)
    about = np.cov(places.T)
    assert np.allclose(found.covariances(np.broadcast_to(about, (100, 3, 3)))[0], scale**2 * turn @ about @ turn.T)


def test_a_map_that_mirrors_stays_one_where_points_lie_in_a_plane() -> None:
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.normal(size=(40, 2)), np.zeros(40)])
    for mirror in (False, True):
        found = SpaceMap(flat, flat, np.ones(40), np.ones(40), mirror).at(np.zeros((1, 3)), np.ones(1))
        assert np.linalg.det(found.turn[0]) == pytest.approx(-1 if mirror else 1)
        assert np.allclose(found.turn[0][:2, :2], np.eye(2), atol=1e-9)


def test_near_points_decide_and_uncertain_ones_do_not() -> None:
    rng = np.random.default_rng(1)
    left, right = rng.normal(size=(2, 100, 3)) * 0.1 + np.array([[[-2.0, 0, 0]], [[2.0, 0, 0]]])
    here, there = (
        np.concatenate([left, right]),
        np.concatenate([left + np.array([0, 0, 1]), right + np.array([0, 0, -1])]),
    )
    space = SpaceMap(here, there, np.ones(200), np.ones(200), False)
    places = np.array([[-2.0, 0, 0.1], [2.0, 0, 0.1]])
    moved = space.at(places, np.full(2, 0.05))(places) - places
    assert np.allclose(moved[:, 2], [1, -1], atol=0.05)
    wild = np.concatenate([there[:100], there[100:] + 50 * rng.normal(size=(100, 3))])
    doubted = SpaceMap(here, wild, np.ones(200), np.repeat([1.0, 0.0], 100), False)
    there_and_there = [one.at(places[:1], np.full(1, 0.05))(places[:1]) for one in (doubted, space)]
    assert np.abs(np.subtract(*there_and_there)).max() < 0.05


def test_pairs_that_are_left_out_do_not_count() -> None:
    space, scale, turn, shift = random_map(3, False)
    spoiled = SpaceMap(space.here, space.there + np.eye(50)[:, :1] * 100, space.weights, np.ones(50), False)
    omitted = np.zeros((1, 50), bool)
    omitted[0, 0] = True
    place = space.here[:1]
    assert np.allclose(spoiled.at(place, np.ones(1), omitted)(place), scale * place @ turn.T + shift)
