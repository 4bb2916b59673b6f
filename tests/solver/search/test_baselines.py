import tracemalloc

import numpy as np
import pytest
from instances import disc_points, planted
from scipy.optimize import approx_fprime

from solver import Mobius, search
from solver.mobius import hyperbolic_distance
from solver.search.baselines import brute_force, gradient_descent, graph_matching, icp, voting
from solver.search.baselines.gradient_descent import _unmatched
from solver.search.baselines.incumbent import incumbent
from solver.search.baselines.voting import through_two_pairs
from solver.search.fit import algebraic_fit, fitted, images, parameters, transformation
from solver.search.matching import matching

ANYWHERE = Mobius(0.4 - 0.3j, 2.0)
MILD = Mobius(0.05 - 0.03j, 0.1)  # what a local method can be asked to find
METHODS = {
    "brute_force": (brute_force, ANYWHERE),
    "brute_force on a grid": (lambda *a, **k: brute_force(*a, rotations=360, **k), ANYWHERE),
    "voting": (lambda *a, **k: voting(*a, samples=6000, **k), ANYWHERE),
    "voting, one table": (lambda *a, **k: voting(*a, samples=6000, ballot="shared", **k), ANYWHERE),
    "graph_matching": (graph_matching, ANYWHERE),
    "gradient_descent": (gradient_descent, MILD),
    "icp": (icp, MILD),
}
every_method = pytest.mark.parametrize(("method", "f"), METHODS.values(), ids=METHODS.keys())


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
@every_method
def test_planted_transformation_is_found(method, f, metric):
    rng = np.random.default_rng(4)
    outliers = 0 if method is icp else 6  # plain least squares bears none
    source, target = planted(rng, f, 30, outliers / 30, 0.001)
    found = method(source, target, 0.05, metric=metric, z_max=0.7)
    problem = matching(source, target, 0.05, metric=metric)
    assert np.median(np.abs(found.mobius(source) - f(source))) < 0.05
    assert found.value >= 30 - outliers
    assert found.value == problem.value(found.mobius) == len(found.matches)
    assert found.upper_bound == problem.limit == 30
    assert not found.certified
    assert not found.cancelled
    assert found.nodes > 0


@every_method
def test_reflection_is_found_where_it_is_asked_for(method, f):
    rng = np.random.default_rng(5)
    source, target = planted(rng, f, 25, 0.0, 0.001)
    found = method(np.conj(source), target, 0.05, reflect=True)
    assert found.mobius.reflected
    assert hyperbolic_distance(found.mobius(np.conj(source)), f(source)).max() < 0.1
    assert method(np.conj(source), target, 0.05).value < found.value


@every_method
def test_incompatible_pairs_are_never_matched(method, f):
    rng = np.random.default_rng(6)
    source, target = planted(rng, f, 25, 0.2, 0.001)
    weights = rng.random((25, 25)) * (rng.random((25, 25)) < 0.5)
    weights[3] = 0
    found = method(source, target, 0.05, weights=weights)
    problem = matching(source, target, 0.05, weights=weights)
    assert found.value == problem.value(found.mobius)
    assert found.upper_bound == problem.limit
    assert (weights[tuple(found.matches.T)] > 0).all()
    assert method(source, target, 0.05, weights=np.zeros((25, 25))).value == 0


@every_method
def test_nothing_beats_the_proven_optimum(method, f):
    rng = np.random.default_rng(7)
    for metric in ("hyperbolic", "euclidean"):
        source, target = planted(rng, f, 12, 0.4, 0.02)
        proven = search(source, target, 0.04, metric=metric, z_max=0.8)
        assert proven.certified
        found = method(source, target, 0.04, metric=metric, z_max=0.8)
        assert found.value <= proven.value
        assert abs(found.mobius.z) <= 0.8


@every_method
def test_ends_when_told_to_with_a_valid_result(method, f):
    rng = np.random.default_rng(8)
    source, target = planted(rng, f, 60, 0.5, 0.02)
    problem = matching(source, target, 0.02)
    seen = []
    ended = [method(source, target, 0.02, time_limit=0.0)]
    assert ended[0].seconds < 2
    # reports come at most ten times a second, so that a fast method may end before the first
    ended.append(method(source, target, 0.02, progress=lambda state: seen.append(state) or False))
    assert ended[1].cancelled == bool(seen)
    for state in seen:
        assert 0 <= state.value <= state.upper_bound == 60
    for result in ended:
        assert result.value == problem.value(result.mobius)


@every_method
def test_wrong_arguments_are_refused_as_search_refuses_them(method, f):
    for wrong in ({"z_max": 1.0}, {"time_limit": -1.0}, {"threads": 0}, {"metric": "spherical"}):
        with pytest.raises(ValueError, match=r"z_max|time_limit|threads|metric") as of_method:
            method([0.1], [0.2], 0.1, **wrong)
        with pytest.raises(ValueError) as of_search:  # noqa: PT011  (the text is compared)
            search([0.1], [0.2], 0.1, **wrong)
        assert str(of_method.value) == str(of_search.value)


@every_method
def test_points_at_the_centre_on_the_rim_and_coincident(method, f):
    rng = np.random.default_rng(9)
    source = np.concatenate([[0, 0, 1, -1, 1j], disc_points(rng, 5)])
    target = np.concatenate([[0, 1j, 1j, -1, 0.999], disc_points(rng, 5)])
    for points, metric in ((target, "euclidean"), (0.999 * target, "hyperbolic")):
        found = method(source, points, 0.05, metric=metric)
        assert found.value == matching(source, points, 0.05, metric=metric).value(found.mobius)


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
def test_brute_force_is_the_best_over_all_pairings_and_rotations(metric):
    rng = np.random.default_rng(10)
    z_max = 0.7
    source, target = disc_points(rng, 7), disc_points(rng, 6, 0.9)
    weights = rng.random((7, 6)) * (rng.random((7, 6)) < 0.8)
    problem = matching(source, target, 0.1, metric=metric, weights=weights)
    slow = 0.0
    for j, m in enumerate(source):
        for b in target[weights[j] > 0]:
            for theta in 2 * np.pi * np.arange(720) / 720:
                f = Mobius(b, 0).inverse() @ Mobius(m, theta)
                if abs(f.z) <= z_max:
                    slow = max(slow, problem.value(f))
    swept = brute_force(source, target, 0.1, metric=metric, weights=weights, z_max=z_max)
    tried = brute_force(source, target, 0.1, metric=metric, weights=weights, z_max=z_max, rotations=720)
    assert tried.value == pytest.approx(slow)
    assert swept.value >= tried.value
    assert tried.nodes == 720 * swept.nodes


def test_brute_force_in_euclidean_discs_that_reach_out_of_the_unit_disc():
    """Where the pole of the frame would lie in a match disc, its image is no disc."""
    rng = np.random.default_rng(11)
    f = Mobius(0.3, 1.0)
    source = np.append(disc_points(rng, 15, 0.8), 0.99 * np.exp(1j * np.arange(3)))
    target = f(source)
    assert np.abs(target).max() > 0.98
    found = brute_force(source, target, 0.1, metric="euclidean", z_max=0.6)
    assert found.value == 18
    assert abs(found.mobius.z) <= 0.6


def test_two_pairs_are_met_exactly_or_with_the_error_divided_evenly():
    rng = np.random.default_rng(12)
    x1, x2 = disc_points(rng, 50, 0.9), disc_points(rng, 50, 0.9)
    z, theta = through_two_pairs(x1, x2, ANYWHERE(x1), ANYWHERE(x2))
    assert np.abs(z - ANYWHERE.z).max() < 1e-9
    assert np.abs(np.exp(1j * theta) - np.exp(1j * ANYWHERE.theta)).max() < 1e-9
    y1, y2 = disc_points(rng, 50, 0.9), disc_points(rng, 50, 0.9)
    z, theta = through_two_pairs(x1, x2, y1, y2)
    for k in range(50):
        f = Mobius(complex(z[k]), theta[k])
        off = 2 * np.arctanh(hyperbolic_distance(f([x1[k], x2[k]]), [y1[k], y2[k]]))
        apart = 2 * np.arctanh([hyperbolic_distance(x1[k], x2[k]), hyperbolic_distance(y1[k], y2[k])])
        assert off == pytest.approx([abs(apart[0] - apart[1]) / 2] * 2, abs=1e-8)


def test_fits_recover_exact_data_and_derivatives_are_right():
    rng = np.random.default_rng(13)
    x, weights = disc_points(rng, 9, 0.9), rng.random(9) + 0.1
    y = ANYWHERE(x)
    for found in (
        algebraic_fit(x, y, weights),
        fitted(x, y, weights, Mobius(0.2, 1.5), metric="euclidean", z_max=0.9),
        fitted(x, y, weights, Mobius(0.2, 1.5), metric="hyperbolic", z_max=0.9),
    ):
        assert np.abs(found(x) - y).max() < 1e-6
    assert algebraic_fit(x, np.conj(x), weights).z == pytest.approx(0, abs=1)  # no automorphism fits: still a Mobius
    p = parameters(ANYWHERE, 0.9)
    assert transformation(p, 0.9).z == pytest.approx(ANYWHERE.z)
    derivative = images(x, p, 0.9)[1]
    for k in range(9):
        for part in (np.real, np.imag):
            numeric = approx_fprime(p, lambda q, k=k, part=part: float(part(images(x[k : k + 1], q, 0.9)[0][0])))
            assert part(derivative[k]) == pytest.approx(numeric, abs=1e-5)


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
def test_gradient_of_the_smoothed_objective(metric):
    rng = np.random.default_rng(14)
    source, target = disc_points(rng, 8, 0.9), disc_points(rng, 9, 0.9)
    best = incumbent(
        source, target, 0.1, metric=metric, weights=rng.random((8, 9)), z_max=0.9, reflect=False, time_limit=None,
        threads=None, progress=None,
    )  # fmt: skip
    p, width = np.array([0.3, -0.2, 0.7]), rng.uniform(0.1, 0.5, 9)
    value, gradient = _unmatched(p, best, source, width)
    assert 0 < value < 8
    numeric = approx_fprime(p, lambda q: _unmatched(q, best, source, width)[0], 1e-7)
    assert gradient == pytest.approx(numeric, abs=1e-5)


def test_voting_is_reproducible_and_depends_on_its_seed_alone():
    rng = np.random.default_rng(15)
    source, target = planted(rng, ANYWHERE, 15, 0.2, 0.01)
    one, same, other = (voting(source, target, 0.03, samples=500, seed=s).mobius for s in (1, 1, 2))
    assert one == same
    assert one != other


def test_a_fit_of_many_points_needs_no_more_memory_than_they():
    """As the vertices of a scan: a square matrix of so many rows would fill the machine."""
    rng = np.random.default_rng(5)
    x = 0.9 * np.sqrt(rng.random(5000)) * np.exp(2j * np.pi * rng.random(5000))
    truth = Mobius(0.3 - 0.2j, 1.0)
    tracemalloc.start()
    found = algebraic_fit(x, truth(x), np.ones(len(x)))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert np.abs(found(x) - truth(x)).max() < 1e-9
    assert most < 100 * x.nbytes
