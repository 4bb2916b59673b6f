import numpy as np
import pytest

from solver.search.stabbing import stab


def slow_stab(point, centre, half_width, weight, points):
    """The best over all arc ends and middles, by testing each arc for each of them."""
    best = 0.0
    for theta in np.concatenate([centre - half_width, centre + half_width, centre]):
        away = np.abs(np.remainder(theta - centre + np.pi, 2 * np.pi) - np.pi)
        held = (away <= half_width + 1e-9) | (half_width >= np.pi)
        most = np.zeros(points)
        np.maximum.at(most, point[held], weight[held])
        best = max(best, most.sum())
    return best


def weight_at(theta, point, centre, half_width, weight, points):
    away = np.abs(np.remainder(theta - centre + np.pi, 2 * np.pi) - np.pi)
    held = (away <= half_width + 1e-12) | (half_width >= np.pi)
    most = np.zeros(points)
    np.maximum.at(most, point[held], weight[held])
    return most.sum()


@pytest.mark.parametrize("seed", range(40))
def test_against_the_quadratic_reference(seed):
    rng = np.random.default_rng(seed)
    groups, points, n = 5, int(rng.integers(1, 8)), int(rng.integers(1, 60))
    group = rng.integers(0, groups, n)
    point = rng.integers(0, points, n)
    centre = rng.uniform(-7, 7, n)
    half_width = rng.choice([0.01, 0.3, 1.0, 3.1, 4.0], n) * rng.random(n)
    weight = rng.integers(1, 5, n) / 4 if seed % 2 else np.ones(n)
    values, rotations = stab(group, point, centre, half_width, weight, groups, points)
    for g in range(groups):
        here = group == g
        arcs = point[here], centre[here], half_width[here], weight[here], points
        assert values[g] == (slow_stab(*arcs) if here.any() else 0)
        assert weight_at(rotations[g], *arcs) == values[g]


def test_a_point_counts_once_with_its_heaviest_arc():
    values, _ = stab(
        np.zeros(3, int), np.zeros(3, int), np.array([0.0, 0.1, 0.2]), np.full(3, 0.5), np.array([0.25, 1, 0.5]), 1, 1
    )
    assert values.tolist() == [1]


def test_arcs_that_touch_share_their_end():
    values, rotations = stab(
        np.zeros(2, int), np.arange(2), np.array([1.0, 2.0]), np.array([0.5, 0.5]), np.ones(2), 1, 2
    )
    assert values.tolist() == [2]
    assert rotations[0] == pytest.approx(1.5)


def test_arcs_across_the_cut_and_full_circles():
    arcs = np.array([np.pi, -np.pi, 0.0, 3.0]), np.array([0.2, 0.2, np.pi, 7.0])
    values, rotations = stab(np.zeros(4, int), np.arange(4), *arcs, np.ones(4), 1, 4)
    assert values.tolist() == [4]
    assert abs(rotations[0] - np.pi) <= 0.2
    across = np.array([0.0, 2 * np.pi - 0.1, 0.05]), np.array([0.01, 0.11, 0.06])
    assert stab(np.zeros(3, int), np.arange(3), *across, np.ones(3), 1, 3)[0].tolist() == [3]


def test_groups_without_arcs_are_worth_nothing():
    values, _ = stab(np.array([2]), np.array([0]), np.array([0.0]), np.array([0.1]), np.ones(1), 4, 1)
    assert values.tolist() == [0, 0, 1, 0]
    none = np.zeros(0)
    assert stab(none.astype(int), none.astype(int), none, none, none, 3, 2)[0].tolist() == [0, 0, 0]
