import sys
import time

import numpy as np
import pytest
from instances import brute_force, disc_points, nasty_points, planted

from solver import Mobius, search
from solver.mobius import hyperbolic_distance
from solver.search.matching import matching


def random_mobius(rng, largest):
    return Mobius(complex(disc_points(rng, 1, largest)[0]), rng.uniform(0, 2 * np.pi))


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
@pytest.mark.parametrize("outliers", [0.0, 0.25, 0.5])
def test_planted_transformation_is_recovered(metric, outliers):
    rng = np.random.default_rng(7)
    f = random_mobius(rng, 0.6)
    source, target = planted(rng, f, 40, outliers, 0.002)
    found = search(source, target, 0.02, metric=metric, z_max=0.8)
    assert found.certified
    assert found.value >= (1 - outliers) * 40 - 2
    assert found.value == matching(source, target, 0.02, metric=metric).value(found.mobius)
    good = source[np.abs(source) < 0.5]
    assert hyperbolic_distance(found.mobius(good), f(good)).max() < 0.05


@pytest.mark.parametrize("seed", range(6))
def test_optimum_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    metric = ["hyperbolic", "euclidean"][seed % 2]
    n1, n2 = rng.integers(3, [8, 13])
    weights = None if seed < 2 else rng.random((n1, n2)) * (rng.random((n1, n2)) < 0.6)
    source, target = nasty_points(rng, n1), disc_points(rng, n2, 0.95)
    found = search(source, target, 0.1, metric=metric, weights=weights, z_max=0.7)
    assert found.certified
    problem = matching(source, target, 0.1, metric=metric, weights=weights)
    assert brute_force(problem, 0.7, 12) <= found.value
    assert problem.value(found.mobius) == found.value
    assert abs(found.mobius.z) <= 0.7


def test_the_printed_objective_collapses_and_the_bound_on_z_prevents_it():
    """One target point near the rim lets |z| -> 1 match every source point in the Euclidean metric (design.md 2.1)."""
    rng = np.random.default_rng(0)
    f = Mobius(0.3, 1.0)
    source = disc_points(rng, 40, 0.9)
    target = np.append(f(source[:25]), 0.995)
    collapsed = search(source, target, 0.02, metric="euclidean", z_max=0.9999)
    assert collapsed.certified
    assert collapsed.value == 40
    assert abs(collapsed.mobius.z) > 0.95
    for wise in (
        search(source, target, 0.02, metric="euclidean", z_max=0.8),
        search(source, target, 0.02, metric="hyperbolic", z_max=0.98),
    ):
        assert wise.certified
        assert 25 <= wise.value <= 30
        assert abs(wise.mobius.z - 0.3) < 0.05


def test_reflection_is_found_and_reported():
    rng = np.random.default_rng(3)
    source = disc_points(rng, 25, 0.9)
    target = Mobius(-0.2 + 0.3j, 2.0, reflected=True)(source)
    both = search(source, target, 0.02, z_max=0.8, reflect=True)
    assert both.certified
    assert both.value == 25
    assert both.mobius.reflected
    plain = search(source, target, 0.02, z_max=0.8)
    assert not plain.mobius.reflected
    assert plain.value < 15
    upright = search(np.conj(source), target, 0.02, z_max=0.8, reflect=True)
    assert (upright.value, upright.mobius.reflected) == (25, False)


@pytest.mark.parametrize("seed", range(3))
def test_value_does_not_depend_on_order_or_conjugation(seed):
    rng = np.random.default_rng(seed)
    source, target = planted(rng, random_mobius(rng, 0.5), 15, 0.4, 0.01)
    weights = rng.random((15, 15))
    j, k = rng.permutation(15), rng.permutation(15)
    plain = search(source, target, 0.05, weights=weights, z_max=0.8)
    shuffled = search(source[j], target[k], 0.05, weights=weights[np.ix_(j, k)], z_max=0.8)
    mirrored = search(np.conj(source), np.conj(target), 0.05, weights=weights, z_max=0.8)
    assert plain.certified
    assert plain.value == shuffled.value == mirrored.value


@pytest.mark.parametrize("seed", range(3))
def test_hyperbolic_value_survives_mobius_maps_of_either_side(seed):
    """Before: the optimum moves within |z| <= z_max; the hyperbolic objective itself is invariant."""
    rng = np.random.default_rng(seed)
    f = random_mobius(rng, 0.4)
    source, target = planted(rng, f, 15, 0.3, 0.005)
    before, after = random_mobius(rng, 0.3), random_mobius(rng, 0.3)
    plain = search(source, target, 0.03, z_max=0.7)
    moved = search(before(source), after(target), 0.03, z_max=0.9)
    assert plain.certified
    assert moved.certified
    # the whole |z| <= .7 of the first lies within |z| <= .9 of the second, up to the far side
    assert moved.value >= plain.value


def test_matches_are_pairs_within_reach():
    rng = np.random.default_rng(9)
    source, target = planted(rng, Mobius(0.2j, 1.0), 30, 0.3, 0.005)
    found = search(source, target, 0.03, z_max=0.7)
    assert len(found.matches) == found.value
    j, k = found.matches.T
    assert len(set(j.tolist())) == len(j)
    assert hyperbolic_distance(found.mobius(source[j]), target[k]).max() <= 0.03 + 1e-12


def test_anytime_the_bound_holds():
    rng = np.random.default_rng(5)
    source, target = disc_points(rng, 100), disc_points(rng, 100, 0.99)
    started = time.perf_counter()
    short = search(source, target, 0.02, time_limit=0.2, z_max=0.8)
    assert time.perf_counter() - started < 3
    assert short.value <= short.upper_bound <= 100
    assert short.certified == (short.value == short.upper_bound)
    assert short.gap == short.upper_bound - short.value
    assert not short.cancelled
    assert short.value == matching(source, target, 0.02).value(short.mobius)


def test_cancel():
    rng = np.random.default_rng(5)
    source, target = disc_points(rng, 200), disc_points(rng, 200, 0.99)
    seen = []

    def stop(progress):
        seen.append(progress)
        return len(seen) < 2

    started = time.perf_counter()
    found = search(source, target, 0.01, progress=stop, z_max=0.9)
    assert time.perf_counter() - started < 5
    assert found.cancelled
    assert not found.certified
    assert len(seen) == 2
    assert seen[0].value <= found.value <= found.upper_bound <= seen[0].upper_bound
    assert seen[0].nodes <= seen[1].nodes <= found.nodes


def test_same_input_same_answer():
    rng = np.random.default_rng(6)
    source, target = planted(rng, random_mobius(rng, 0.5), 30, 0.5, 0.01)
    a, b = (search(source, target, 0.02, z_max=0.8) for _ in range(2))
    assert (a.value, a.upper_bound, a.nodes, a.mobius) == (b.value, b.upper_bound, b.nodes, b.mobius)


def test_any_number_of_threads_finds_the_same():
    rng = np.random.default_rng(8)
    source, target = planted(rng, random_mobius(rng, 0.5), 60, 0.5, 0.01)
    found = [search(source, target, 0.02, z_max=0.8, threads=n) for n in (1, 2, 5)]
    assert len({(f.value, f.upper_bound, f.nodes, f.mobius) for f in found}) == 1


def test_a_full_frontier_is_searched_depth_first(monkeypatch):
    rng = np.random.default_rng(10)
    source, target = planted(rng, random_mobius(rng, 0.5), 40, 0.6, 0.01)
    free = search(source, target, 0.03, z_max=0.8)
    monkeypatch.setattr(sys.modules["solver.search.frontier"], "FRONTIER", 20)
    held = search(source, target, 0.03, z_max=0.8)
    assert held.certified
    assert held.value == free.value


@pytest.mark.parametrize("smallest", [2.0**-4, 2.0**-7, 2.0**-9])
def test_what_cells_too_small_to_split_leave_open_is_reported_as_a_gap(monkeypatch, smallest):
    rng = np.random.default_rng(11)
    source, target = planted(rng, random_mobius(rng, 0.5), 40, 0.4, 0.01)
    optimum = search(source, target, 0.02, z_max=0.8)
    assert optimum.certified
    monkeypatch.setattr(sys.modules["solver.search.frontier"], "SMALLEST_CELL", smallest)
    coarse = search(source, target, 0.02, z_max=0.8)
    assert coarse.value <= optimum.value <= coarse.upper_bound
    assert not coarse.certified
    # what is left is what the undecided cells may hold, not what was never looked at
    assert coarse.upper_bound < len(source)
    assert coarse.value == matching(source, target, 0.02).value(coarse.mobius)


@pytest.mark.parametrize("seed", range(4))
def test_compatible_pairs_alone_count(seed):
    """Weights of 0 and 1, weights of 1 and less, and one raster for all: the same optimum where they say the same."""
    rng = np.random.default_rng(seed)
    source, target = planted(rng, random_mobius(rng, 0.5), 30, 0.4, 0.01)
    far = np.append(target, 0.99j)  # compatible with nothing: so every source point gets a row of its own
    allowed = np.ones((30, 31))
    allowed[:, 30] = 0
    shared = search(source, target, 0.03, z_max=0.8)
    own = search(source, far, 0.03, weights=allowed, z_max=0.8)
    halved = search(source, far, 0.03, weights=allowed / 2, z_max=0.8)
    assert shared.certified
    assert own.certified
    assert halved.certified
    assert shared.value == own.value == 2 * halved.value


def test_one_to_one_counts_no_target_twice():
    target = np.array([0.3, -0.5])
    many = search([0.3, 0.3001, 0.2999, -0.5], target, 0.05, z_max=0.3)
    assert (many.value, many.one_to_one) == (4, 2)
    weights = np.array([[0.5, 0], [0.25, 0], [0, 1.0]])
    weighted = search([0.3, 0.3, -0.5], target, 0.05, weights=weights, z_max=0.3)
    assert (weighted.value, weighted.one_to_one) == (1.75, 1.5)


def test_nothing_is_compatible():
    found = search([0.1, 0.2], [0.3], 0.1, weights=np.zeros((2, 1)))
    assert (found.value, found.upper_bound, found.certified) == (0, 0, True)
    assert found.matches.shape == (0, 2)


def test_one_point_each():
    found = search([0.4], [-0.7j], 0.05)
    assert (found.value, found.certified) == (1, True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"z_max": 0}, "z_max must lie between 0 and 1"),
        ({"z_max": 1.0}, "z_max must lie between 0 and 1"),
        ({"z_max": float("nan")}, "z_max must lie between 0 and 1"),
        ({"time_limit": -1}, "time_limit must be"),
        ({"time_limit": float("nan")}, "time_limit must be"),
        ({"threads": 0}, "threads must be at least 1"),
        ({"metric": "cosine"}, "unknown metric"),
    ],
)
def test_absurd_options_are_refused_by_name(options, words):
    with pytest.raises(ValueError, match=words):
        search([0.1, 0.2], [0.3, 0.4], 0.1, **options)
