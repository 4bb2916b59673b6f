import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from instances import disc_points, nasty_points, planted

from solver import Mobius, search
from solver.search.certificate import Certificate, _alive, _holds_exactly, _Pairs, certify
from solver.search.rational import turn
from solver.search.rim import BITS, exponential


def claim(found):
    return found.mobius, found.value, found.upper_bound


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_values_of_searches_hold_exactly(metric, weighted, seed):
    rng = np.random.default_rng(seed)
    source, target = planted(rng, Mobius(0.3, 1.0), 30, 0.3, 0.01)
    options = {"metric": metric, "weights": rng.random((30, 30)) if weighted else None}
    found = search(source, target, 0.05, z_max=0.7, reflect=seed == 1, **options)
    checked = certify(*claim(found), source, target, 0.05, **options)
    assert checked.value_holds
    assert checked.value == checked.possible == pytest.approx(found.value, abs=1e-4)
    assert checked.bound_holds is None


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
@pytest.mark.parametrize("seed", range(3))
def test_bounds_of_searches_are_proved_again(metric, seed):
    rng = np.random.default_rng(seed)
    source, target = nasty_points(rng, 6), disc_points(rng, 5, 0.9)
    weights = rng.integers(0, 4, (6, 5)) / 4 if seed else None
    options = {"metric": metric, "weights": weights, "z_max": 0.5, "reflect": seed == 2}
    found = search(source, target, 0.2, **options)
    assert found.certified
    checked = certify(*claim(found), source, target, 0.2, prove=True, **options)
    assert checked.bound_holds
    assert checked.value_holds
    assert checked.boxes > 0


def test_a_bound_is_proved_in_rational_arithmetic():
    rng = np.random.default_rng(0)
    source, target = disc_points(rng, 4, 0.8), disc_points(rng, 3, 0.8)
    found = search(source, target, 0.3, z_max=0.3)
    checked = certify(*claim(found), source, target, 0.3, z_max=0.3, prove=True, exact=True)
    assert checked.bound_holds
    assert checked.boxes > 10


def test_claims_that_are_wrong_are_refused():
    rng = np.random.default_rng(1)
    source, target = planted(rng, Mobius(0.2, 1.0), 8, 0.25, 0.0)
    found = search(source, target, 0.1, z_max=0.5)
    f = found.mobius
    assert not certify(f, found.value + 1, found.value + 1, source, target, 0.1).value_holds
    assert not certify(f, found.value - 1, found.value - 1, source, target, 0.1).value_holds
    assert not certify(Mobius(f.z, f.theta + 1), found.value, found.value, source, target, 0.1).value_holds
    low = certify(f, found.value, found.value - 1, source, target, 0.1, z_max=0.5, prove=True, most_boxes=20_000)
    assert low.bound_holds is False


def test_a_pair_on_the_edge_of_its_disc_is_called_for_certain():
    """|0.5 - 0.25| = 0.25 exactly: matched, though no interval of floats could say so."""
    on_edge = certify(Mobius(), 1, 1, [0.5], [0.25], 0.25, metric="euclidean")
    assert on_edge.possible == 1
    beyond = certify(Mobius(), 0, 0, [0.5], [0.25], np.nextafter(0.25, 0), metric="euclidean")
    assert dataclasses.astuple(beyond)[:3] == (0, 0, True)
    assert isinstance(beyond, Certificate)


def test_a_pair_exactly_on_the_edge_is_certain_where_nothing_is_turned():
    assert certify(Mobius(), 1, 1, [0.5], [0.25], 0.25, metric="euclidean").value == 1
    assert certify(Mobius(0, 1e-9), 1, 1, [0.0], [0.25], 0.25, metric="euclidean").value_holds


def planted_four():
    rng = np.random.default_rng(0)
    source = disc_points(rng, 4, 0.8)
    return source, Mobius(0.55 + 0.1j, 1.0)


def test_a_transformation_that_was_not_searched_proves_nothing():
    source, f = planted_four()
    target = f(source)
    beyond = certify(f, 4, 4, source, target, 0.02, z_max=0.1, prove=True)
    assert not beyond.value_holds
    assert "beyond z_max = 0.1" in beyond.objections[0]
    on_bound = certify(f, 4, 4, source, target, 0.02, z_max=abs(f.z) * (1 - 1e-15))
    assert not on_bound.value_holds
    mirrored = Mobius(f.z, f.theta, reflected=True)
    unasked = certify(mirrored, 4, 4, np.conj(source), target, 0.02)
    assert not unasked.value_holds
    assert "reflections were not searched" in unasked.objections[0]
    assert certify(mirrored, 4, 4, np.conj(source), target, 0.02, reflect=True).value_holds


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_claims_that_are_no_numbers_are_refused(wrong):
    source, f = planted_four()
    value = certify(f, wrong, 4, source, f(source), 0.02, z_max=0.9)
    bound = certify(f, 4, wrong, source, f(source), 0.02, z_max=0.9, prove=True)
    assert (value.value_holds, bound.bound_holds) == (False, False)
    assert "not a finite number" in value.objections[0] + bound.objections[0]


def test_a_bound_below_what_is_reached_is_refused_without_a_proof():
    source, f = planted_four()
    low = certify(f, 4, 3, source, f(source), 0.02, z_max=0.9)
    assert low.bound_holds is False
    assert "below the 4.0" in low.objections[0]
    assert certify(f, 4, 4, source, f(source), 0.02, z_max=0.9).objections == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"z_max": np.nan}, "z_max must lie"),
        ({"z_max": -1.0}, "z_max must lie"),
        ({"z_max": 1.0}, "z_max must lie"),
        ({"radius": -0.02}, "every radius"),
        ({"radius": np.nan}, "every radius"),
        ({"radius": [0.1, 0.1]}, "one per target point"),
        ({"radius": 1.0}, "below 1"),
        ({"metric": "Hyperbolic"}, "unknown metric 'Hyperbolic'"),
        ({"weights": np.full((4, 4), np.nan)}, "every weight"),
        ({"weights": np.full((4, 4), 2.0)}, "every weight"),
        ({"weights": np.ones((4, 3))}, "weights must be of shape"),
        ({"source": [0.1, np.nan, 0, 0]}, "the source must be finite"),
        ({"source": [[0.1, 0, 0, 0]]}, "the source must be a flat"),
        ({"target": [0.1, 0, 0, 1.5]}, "the target must be finite"),
        ({"target": [0.1, 0, 0, 1j]}, "inside the unit circle"),
    ],
)
def test_input_that_cannot_be_searched_is_refused_by_name(change, words):
    source, f = planted_four()
    given = {"source": source, "target": f(source), "radius": 0.02} | change
    places = given.pop("source"), given.pop("target"), given.pop("radius")
    with pytest.raises(ValueError, match=words):
        certify(f, 4, 4, *places, prove=True, **given)


def test_many_turns_are_one_rotation():
    source, f = planted_four()
    assert certify(Mobius(f.z, f.theta + 2000 * np.pi), 4, 4, source, f(source), 0.02).value_holds
    assert not certify(Mobius(f.z, f.theta + 2001 * np.pi), 4, 4, source, f(source), 0.02).value_holds


@pytest.mark.parametrize("theta", [0.0, 1.0, -2.5, 3.14, 6.283, 9.0, 1e-9, 6283.0, -1e6])
def test_exponential_in_rational_numbers(theta):
    (real, imag), off = turn(theta)
    assert off < Fraction(1, 1 << 100)
    assert abs(real * real + imag * imag - 1) <= 4 * off
    assert (theta == 0) == (off == 0)
    assert (float(real), float(imag)) == pytest.approx((np.cos(theta), np.sin(theta)), abs=1e-15)
    (whole, part), error = exponential(theta)
    assert abs(Fraction(whole, 1 << BITS) - real) <= Fraction(error, 1 << BITS) + off
    assert abs(Fraction(part, 1 << BITS) - imag) <= Fraction(error, 1 << BITS) + off


@pytest.mark.parametrize("hyperbolic", [False, True])
def test_no_pair_is_ruled_out_that_some_transformation_of_the_box_matches(hyperbolic):
    rng = np.random.default_rng(2)
    m, b = nasty_points(rng, 60), disc_points(rng, 60, 0.99)
    pairs = _Pairs(np.arange(60), m, b, rng.uniform(0.05, 0.4, 60), np.ones(60), hyperbolic, 60)
    seen = 0
    for _ in range(300):
        half, t = 2.0 ** -rng.integers(2, 9), 2.0 ** -rng.integers(1, 9)
        z0, theta0 = complex(disc_points(rng, 1, 0.8)[0]), rng.uniform(-3, 3)
        box = np.array([[z0.real, z0.imag, half, theta0, t]])
        alive = _alive(pairs, box)[0]
        side = rng.uniform(-1, 1, 3)
        z = z0 + half * complex(side[0], side[1])
        f = Mobius(z if abs(z) < 1 else z0, theta0 + t * side[2])
        x = f(m)
        distance = np.abs(x - b) / (np.abs(1 - np.conj(b) * x) if hyperbolic else 1)
        matched = distance <= pairs.tau
        assert not (matched & ~alive).any()
        seen += int((~alive).sum())
    assert seen > 1000
    assert not _holds_exactly(pairs, np.array([0.0, 0, 1, 0, 4]), 59)
