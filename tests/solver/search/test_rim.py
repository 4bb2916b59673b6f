"""Pairs next to the rim of their discs, where floats do not decide whether they are matched."""

from fractions import Fraction

import numpy as np
import pytest

from solver import Mobius, search
from solver.mobius import hyperbolic_disc, one_less_square
from solver.search.certificate import certify
from solver.search.matching import MOST_EXACT, matching
from solver.search.rim import surely_within


def exact_square(x):
    return Fraction(x.real) ** 2 + Fraction(x.imag) ** 2


def on_axis(rng, gap):
    """A target point some `gap` from the rim, a source point farther in, and their exact distance."""
    b = 1 - gap * rng.uniform(1, 2)
    m = 1 - (1 - b) * rng.uniform(1.1, 1.4)
    return m, b, abs(Fraction(m) - Fraction(b)) / (1 - Fraction(m) * Fraction(b))


@pytest.mark.parametrize("gap", [1e-6, 1e-8, 1e-10, 1e-12, 1e-14])
@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
def test_values_next_to_the_rim_are_those_of_exact_arithmetic(gap, metric):
    rng = np.random.default_rng(0)
    for _ in range(60):
        m, b, apart = on_axis(rng, gap)
        if metric == "euclidean":
            apart = abs(Fraction(m) - Fraction(b))
        for side in (1, -1):
            radius = float(apart * (1 - side * Fraction(10 ** rng.uniform(-16, -4))))
            problem = matching([m], [b], radius, metric=metric)
            assert problem.value(Mobius()) == (apart <= Fraction(radius))


@pytest.mark.parametrize("gap", [1e-8, 1e-11, 1e-13])
def test_nothing_next_to_the_rim_is_certified_that_does_not_hold(gap):
    rng = np.random.default_rng(1)
    reached = 0
    for _ in range(15):
        m, b, apart = on_axis(rng, gap)
        for side in (1, -1):
            radius = float(apart * (1 - side * Fraction(rng.uniform(1e-5, 1e-4))))
            # |z| <= 1e-7 moves points by far less than radius and distance differ
            found = search([m], [b], radius, z_max=1e-7, threads=1, time_limit=0.2)
            checked = certify(found.mobius, found.value, found.upper_bound, [m], [b], radius, z_max=1e-7)
            assert checked.value_holds
            assert found.value == (side == -1)
            assert found.upper_bound >= found.value
            assert not (found.certified and side == 1 and found.value)
            reached += found.certified
    assert reached >= 15


def test_matches_and_value_agree_on_the_rim():
    problem = matching([0.5, 0.5, 0.25], [0.25, 0.75], [0.25, np.nextafter(0.25, 0)], metric="euclidean")
    assert problem.hits(Mobius()).tolist() == [0, 2, 4]
    assert problem.matches(Mobius()).tolist() == [[0, 0], [1, 0], [2, 0]]
    assert problem.value(Mobius()) == 3


def test_of_too_many_on_the_rim_some_do_not_count():
    many = MOST_EXACT + 100
    problem = matching(np.full(many, 0.5), [0.25], 0.25, metric="euclidean")
    assert problem.value(Mobius()) == len(problem.matches(Mobius())) == MOST_EXACT


def test_reflected_pairs_on_the_rim():
    m, b, radius = np.array([0.5j]), np.array([-0.25j]), np.array([0.25])
    assert surely_within(Mobius(0, 0, True), m, b, radius, hyperbolic=False).tolist() == [True]
    assert surely_within(Mobius(), m, b, radius, hyperbolic=False).tolist() == [False]


def test_differences_from_one_keep_their_digits():
    rng = np.random.default_rng(2)
    x = (1 - 10.0 ** rng.uniform(-16, 0, 500)) * np.exp(2j * np.pi * rng.random(500))
    for point, less in zip(x.tolist(), one_less_square(x).tolist(), strict=True):
        exact = 1 - exact_square(point)
        assert abs(Fraction(less) - exact) <= Fraction(2.0**-45) * abs(exact)


def test_discs_are_exact_to_what_the_guard_allows():
    rng = np.random.default_rng(3)
    b = (1 - 10.0 ** rng.uniform(-15, 0, 500)) * np.exp(2j * np.pi * rng.random(500))
    b = b[one_less_square(b) > 0]
    tau = 1 - 10.0 ** rng.uniform(-15, 0, len(b))
    tau = np.clip(np.where(rng.random(len(b)) < 0.3, 1 - tau, tau), 1e-15, 1 - 2.0**-53)
    for point, radius, centre, reach in zip(
        b.tolist(), tau.tolist(), *(x.tolist() for x in hyperbolic_disc(b, tau)), strict=True
    ):
        square, t = exact_square(point), Fraction(radius)
        scale = 1 / (1 - t * t * square)
        assert abs(Fraction(reach) - t * (1 - square) * scale) < Fraction(2.0**-47)
        for part, whole in ((point.real, centre.real), (point.imag, centre.imag)):
            assert abs(Fraction(whole) - Fraction(part) * (1 - t * t) * scale) < Fraction(2.0**-47)


def test_no_z_beyond_the_bound_is_taken_by_a_last_digit():
    """The optimum lies on |z| = z_max, where rounding decides what is inside."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        z_max = float(rng.uniform(0.2, 0.8))
        f = Mobius(z_max * 1.02 * np.exp(2j * np.pi * rng.random()), 1.0)
        source = 0.9 * np.sqrt(rng.random(12)) * np.exp(2j * np.pi * rng.random(12))
        found = search(source, f(source), 0.05, z_max=z_max)
        assert exact_square(found.mobius.z) <= Fraction(z_max) ** 2
        assert certify(found.mobius, found.value, found.upper_bound, source, f(source), 0.05, z_max=z_max).value_holds
