import cmath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instances import disc_points

from solver import Mobius
from solver.flatten.barycentre import conformal_barycentre
from solver.mobius import hyperbolic_disc, hyperbolic_distance

SEEDS = st.integers(0, 2**32 - 1)


def random_mobius(rng, largest=0.95):
    return Mobius(complex(disc_points(rng, 1, largest)[0]), rng.uniform(-9, 9), bool(rng.random() < 0.5))


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_a_group(seed):
    rng = np.random.default_rng(seed)
    a, b, c = (random_mobius(rng) for _ in range(3))
    x = disc_points(rng, 30)
    near = {"rtol": 0, "atol": 1e-10}
    np.testing.assert_allclose((a @ b)(x), a(b(x)), **near)
    np.testing.assert_allclose(((a @ b) @ c)(x), (a @ (b @ c))(x), **near)
    np.testing.assert_allclose(a.inverse()(a(x)), x, **near)
    np.testing.assert_allclose((a @ a.inverse())(x), x, **near)
    assert (a @ b).reflected == (a.reflected != b.reflected)
    assert np.abs(a(x)).max() <= 1 + 1e-12


@settings(max_examples=50, deadline=None)
@given(SEEDS)
def test_keeps_hyperbolic_distance_and_the_rim(seed):
    rng = np.random.default_rng(seed)
    f = random_mobius(rng)
    x, y = disc_points(rng, 20, 0.99), disc_points(rng, 20, 0.99)
    np.testing.assert_allclose(hyperbolic_distance(f(x), f(y)), hyperbolic_distance(x, y), atol=1e-9)
    np.testing.assert_allclose(np.abs(f(np.exp(1j * np.arange(9)))), 1, atol=1e-12)


def test_derivative_is_the_growth_of_lengths():
    rng = np.random.default_rng(0)
    f = random_mobius(rng)
    x, step = disc_points(rng, 20, 0.9), 1e-6
    np.testing.assert_allclose(f.derivative(x), np.abs(f(x + step) - f(x)) / step, rtol=1e-3)


def test_conjugate_and_reflection():
    rng = np.random.default_rng(1)
    x = disc_points(rng, 20)
    f = Mobius(0.3 - 0.2j, 0.7)
    np.testing.assert_allclose(f.conjugate()(x), np.conj(f(np.conj(x))), atol=1e-15)
    np.testing.assert_array_equal(Mobius(f.z, f.theta, True)(x), f(np.conj(x)))


@settings(max_examples=50, deadline=None)
@given(SEEDS)
def test_hyperbolic_discs_are_euclidean_discs(seed):
    rng = np.random.default_rng(seed)
    b, tau = disc_points(rng, 1, 0.99), rng.uniform(0.001, 0.9)
    centre, radius = hyperbolic_disc(b, tau)
    rim = centre + radius * np.exp(2j * np.pi * np.linspace(0, 1, 17))
    np.testing.assert_allclose(hyperbolic_distance(rim, b), tau, rtol=1e-6)


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_barycentre_moves_with_the_points(seed):
    rng = np.random.default_rng(seed)
    x, weights = disc_points(rng, 40), rng.random(40)
    f = Mobius(complex(disc_points(rng, 1, 0.9)[0]), 1.0)
    z = conformal_barycentre(x, weights)
    assert abs(np.average(Mobius(z)(x), weights=weights)) < 1e-10
    assert conformal_barycentre(f(x), weights) == pytest.approx(complex(f(np.array([z]))[0]), abs=1e-8)


@pytest.mark.parametrize("bad", [(1.0, 0), (2j, 0), (complex("nan"), 0), (0, float("inf"))])
def test_parameters_out_of_range_are_refused(bad):
    with pytest.raises(ValueError, match="needs"):
        Mobius(*bad)


def test_equation_1():
    z, theta, x = 0.4 - 0.1j, 0.9, 0.2 + 0.5j
    assert complex(Mobius(z, theta)(x)) == pytest.approx(cmath.exp(1j * theta) * (x - z) / (1 - x * z.conjugate()))
