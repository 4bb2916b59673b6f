"""The assignment of parts: least in all, with none as an alternative, whatever is common to many."""

from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.align.parts.counterparts import NONE, assigned, certainty_of, costs


def brute_force(cost: np.ndarray) -> float:
    """The least sum over all ways to pair rows with columns, an unpaired one of either costing half of `NONE`."""
    n, m = cost.shape
    wide = np.full((n, m + n), NONE)  # a row with none, and the columns left over below
    wide[:, :m] = cost
    best = np.inf
    for choice in permutations(range(m + n), n):
        paired = [(i, j) for i, j in enumerate(choice) if j < m]
        value = sum(cost[i, j] for i, j in paired) + NONE / 2 * (n + m - 2 * len(paired))
        best = min(best, value)
    return best


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 3), st.integers(1, 3))
def test_the_assignment_costs_least(seed: int, n: int, m: int) -> None:
    cost = np.random.default_rng(seed).uniform(0, 2 * NONE, (n, m))
    pairs = np.argwhere(cost < NONE)
    chosen = assigned(pairs, cost[tuple(pairs.T)])
    taken = pairs[chosen]
    assert len(np.unique(taken[:, 0])) == len(np.unique(taken[:, 1])) == len(taken)
    value = cost[tuple(taken.T)].sum() + NONE / 2 * (n + m - 2 * len(taken))
    assert np.isclose(value, brute_force(cost))


def balls(centres: np.ndarray, size: float = 0.1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return centres, np.tile(size**2 * np.eye(3), (len(centres), 1, 1)), np.tile([2, 0], (len(centres), 1))


def test_what_is_common_to_all_changes_nothing() -> None:
    row = np.column_stack([np.arange(10.0), np.zeros(10), np.zeros(10)])
    for shift in (0.0, 0.5, 0.9):
        pairs, cost = costs(balls(row), balls(row + np.array([shift, 0, 0])), 1.0)
        chosen = assigned(pairs, cost)
        assert pairs[chosen].tolist() == [[k, k] for k in range(10)], shift


def test_size_shape_and_topology_count() -> None:
    here = balls(np.zeros((1, 3)))
    centre, about, shape = balls(np.zeros((4, 3)))
    about[1] *= 1.5**2
    about[2] = np.diag([3.0, 0.0, 0.0]) * 0.01
    shape[3] = [1, 1]
    pairs, cost = costs(here, (centre, about, shape), 1.0)
    by_column = np.full(4, np.inf)
    by_column[pairs[:, 1]] = cost
    assert by_column[0] == cost.min() < 1e-9
    # two ratios of 1.5 as a standard deviation of 0.3 has it, nearly the square of the log
    assert np.isclose(by_column[1], (np.log(1.5) / 0.3) ** 2, rtol=0.05)
    assert by_column[2] > by_column[3] > by_column[0]


def test_a_thousand_parts_take_no_time() -> None:
    rng = np.random.default_rng(0)
    places = rng.uniform(size=(1000, 3))
    pairs, cost = costs(balls(places, 0.01), balls(places + rng.normal(0, 1e-3, places.shape), 0.01), 0.02)
    chosen = assigned(pairs, cost)
    assert (pairs[chosen, 0] == pairs[chosen, 1]).mean() > 0.99


def test_certainty_falls_with_alternatives_that_are_elsewhere() -> None:
    pairs = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    cost = np.array([0.1, 0.1, 8.0, 0.1])
    chosen = np.array([0, 3])
    far, near = (certainty_of(pairs, cost, chosen, np.array([[0.0, 0, 0], [x, 0, 0]]), 1.0) for x in (0.5, 0.001))
    assert np.isclose(far[0], 0.5, atol=0.02)
    assert (near > 0.95).all()
    assert far[1] > 0.9
