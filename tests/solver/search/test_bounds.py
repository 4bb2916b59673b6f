import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instances import disc_points, grown, nasty_points, quadratic_best, random_problem

from solver import Mobius
from solver.search.bounds import common_rotation, enclosing_arcs, exact_arcs
from solver.search.kernels.reference import best_rotations, bound_cells
from solver.search.matching import matching

SEEDS = st.integers(0, 2**32 - 1)


def random_cells(rng, problem, count):
    """Dyadic squares of every size; a third of them where something delicate happens: source points, poles, the rim."""
    half = 2.0 ** -rng.integers(1, 34, count)
    near = disc_points(rng, count)
    delicate = rng.random(count) < 0.5
    near[delicate] = rng.choice(problem.source, delicate.sum()) * rng.choice([1, 0.999, 1 - 1e-9], delicate.sum())
    grid = 2 * half
    centre = (np.floor(near.real / grid) + 0.5) * grid + 1j * (np.floor(near.imag / grid) + 0.5) * grid
    return centre, half


def points_of_cells(rng, centre, half):
    """A random point of each cell that lies in the open disc, often on an edge or corner."""
    side = rng.uniform(-1, 1, (2, len(half)))
    side = np.where(rng.random(side.shape) < 0.3, np.sign(side), side)
    z = centre + half * (side[0] + 1j * side[1])
    return z, np.abs(z) < 1


@settings(max_examples=120, deadline=None)
@given(SEEDS)
def test_bound_of_a_cell_exceeds_the_value_at_every_point_of_it(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    centre, half = random_cells(rng, problem, 60)
    bounds = bound_cells(problem, centre, half)
    z, inside = points_of_cells(rng, centre, half)
    values, rotations = best_rotations(problem, z[inside])
    assert (values <= bounds[inside]).all()
    confirmed = [problem.value(Mobius(x, t)) for x, t in zip(z[inside].tolist(), rotations.tolist(), strict=True)]
    assert (np.array(confirmed) <= bounds[inside]).all()


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_bound_of_a_cell_exceeds_the_slow_reference(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, 6)
    centre, half = random_cells(rng, problem, 15)
    bounds = bound_cells(problem, centre, half)
    z, inside = points_of_cells(rng, centre, half)
    for x, bound in zip(z[inside].tolist(), bounds[inside], strict=True):
        assert quadratic_best(problem, x) <= bound


@settings(max_examples=120, deadline=None)
@given(SEEDS)
def test_every_matching_rotation_of_every_z_lies_in_the_enclosing_arc(seed):
    """Pair by pair: stronger than the count, where one arc too wide may hide another too narrow."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    centre, half = random_cells(rng, problem, 40)
    z, inside = points_of_cells(rng, centre, half)
    centre, half, z = centre[inside], half[inside], z[inside]
    kappa = common_rotation(problem.source, centre, np.zeros(len(z), complex))
    kappa += rng.choice([0, 0.3, 10], len(z)) * disc_points(rng, len(z))
    row, pair, middle, width = enclosing_arcs(problem, centre, half, kappa)
    shape = len(z), len(problem.point)
    held_middle, held_width = np.zeros(shape), np.full(shape, -np.inf)
    held_middle[row, pair], held_width[row, pair] = middle, width
    row, pair, middle, width = exact_arcs(problem, z)
    assert np.isfinite(held_width[row, pair]).all()
    middle = middle + np.imag(kappa * (z - centre))[row]
    apart = np.abs(np.remainder(middle - held_middle[row, pair] + np.pi, 2 * np.pi) - np.pi)
    # exact_arcs is good to rounding error only, which grows where an image comes near 0 or z near the rim
    h = np.abs(Mobius(0)(problem.source)[problem.point[pair]] - z[row])
    slack = 1e-14 / np.maximum(h, 1e-9) / np.maximum(1 - np.abs(z[row]), 1e-9)
    assert ((apart + width <= held_width[row, pair] + slack) | (held_width[row, pair] >= np.pi - 1e-12)).all()


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_bound_of_a_point_is_the_value(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    z = disc_points(rng, 20, 0.98)
    bounds = bound_cells(problem, z, np.zeros(20))
    assert (best_rotations(problem, z)[0] <= bounds).all()
    assert (bounds <= best_rotations(grown(problem, 1 + 1e-6), z)[0]).all()


@pytest.mark.parametrize("size", [1e-1, 1e-2, 1e-3, 1e-4])
def test_bounds_of_small_discs_around_the_centre_tend_to_the_value(size):
    """As where a pocket is crowded in the disc: a search of whole heads could not end for them."""
    rng = np.random.default_rng(7)
    target = size * disc_points(rng, 40)
    problem = matching(
        size * disc_points(rng, 12), target, np.abs(target) * rng.uniform(0.9, 1.1, 40), weights=rng.random((12, 40))
    )
    grid = 2.0**-36
    z = size * disc_points(rng, 300)
    z = (np.floor(z.real / grid) + 0.5) * grid + 1j * (np.floor(z.imag / grid) + 0.5) * grid
    bounds = bound_cells(problem, z, np.full(300, grid / 2))
    loose = bounds > best_rotations(problem, z)[0]
    assert loose.mean() < 0.02  # an edge may be as near by chance


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_best_rotation_against_the_slow_reference(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, 7)
    z = disc_points(rng, 6, 0.98)
    values, rotations = best_rotations(problem, z)
    for x, value, rotation in zip(z.tolist(), values, rotations, strict=True):
        assert quadratic_best(grown(problem, 1 - 1e-7), x) <= value <= quadratic_best(grown(problem, 1 + 1e-7), x)
        assert grown(problem, 1 + 1e-9).value(Mobius(x, rotation)) >= value


def test_best_rotation_against_a_dense_grid_of_rotations():
    rng = np.random.default_rng(1)
    for _ in range(10):
        problem = random_problem(rng)
        z = complex(disc_points(rng, 1, 0.95)[0])
        value = best_rotations(problem, np.array([z]))[0][0]
        on_grid = max(problem.value(Mobius(z, theta)) for theta in np.linspace(0, 2 * np.pi, 2000))
        assert on_grid <= value


@pytest.mark.parametrize("m", [0.0, 1.0, 1j, -0.6 + 0.8j, 0.5, 1 - 1e-15])
def test_the_traps(m):
    """The cell holds the pole, m itself, the whole disc; the target is at the centre, on the rim, around the centre."""
    target = np.array([0.0, 0.5, 1.0, 0.05j])
    problem = matching([m], target, 0.1, metric="euclidean")
    for centre, half in [(0j, 1.0), (complex(m), 0.25), (complex(m) * 0.99, 0.1), (complex(m), 2.0**-30), (0.9j, 0.5)]:
        bound = bound_cells(problem, np.array([centre]), np.array([half]))[0]
        rng = np.random.default_rng(0)
        z, inside = points_of_cells(rng, np.full(300, centre), np.full(300, half))
        if inside.any():
            assert best_rotations(problem, z[inside])[0].max() <= bound


def test_pruning_happens():
    """A bound that never says no would pass every test above."""
    rng = np.random.default_rng(2)
    problem = matching(disc_points(rng, 50), disc_points(rng, 50, 0.99), 0.01, metric="euclidean")
    centre = disc_points(rng, 200, 0.8)
    small = bound_cells(problem, centre, np.full(200, 2.0**-12))
    assert small.mean() < 1.2 * best_rotations(problem, centre)[0].mean()
    assert bound_cells(problem, centre, np.full(200, 2.0**-7)).mean() < 0.5 * problem.limit


def test_source_on_the_rim_and_target_far_inside_never_match():
    rng = np.random.default_rng(4)
    source = nasty_points(rng, 6)
    source /= np.maximum(np.abs(source), 1e-9)
    problem = matching(source[np.abs(source) > 0.5], [0.2, 0.3j], 0.1, metric="euclidean")
    assert bound_cells(problem, np.array([0.25 + 0.25j]), np.array([2.0**-8])).tolist() == [0]
