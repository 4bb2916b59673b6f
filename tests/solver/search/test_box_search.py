"""Boxes of Möbius transformations of the sphere: what they are, and their bounds."""

import sys

import numpy as np
from attacks import libraries, violations
from box_attacks import attack, boxes_around, cells_of
from hypothesis import given, settings
from hypothesis import strategies as st
from sphere_attacks import cornered_problem, kernels_of, seen_through_wider_caps
from spheres import random_mobius, sphere_points, unit

from solver.mobius import SphereMobius, spinors
from solver.search.box_bounds import bounds_of, place_of, polar, transformation
from solver.search.frontier import SMALLEST_CELL
from solver.search.kernels.box_kernels import CompiledBoxKernels, halved, most_of
from solver.search.kernels.boxes import FACE, FREE, MIDDLE, SIDES, new_boxes, points, whole_group
from solver.search.sphere_matching import sphere_matching
from solver.search.sphere_seeds import seeds, through


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**9))
def test_no_bound_of_a_box_is_below_a_value(seed):
    assert not violations(cells_of(seed, 60))


def test_the_attack_sees_what_is_wrong():
    assert seen_through_wider_caps(attack) > 20


def test_boxes_and_transformations_agree():
    rng = np.random.default_rng(0)
    x = sphere_points(rng, 20)
    for _ in range(60):
        f = random_mobius(rng, reflect=False)
        assert np.abs(transformation(place_of(f))(x) - f(x)).max() < 1e-12


def test_all_boxes_together_are_the_whole_group():
    rng = np.random.default_rng(0)
    for _ in range(200):
        f = random_mobius(rng, reflect=False)
        place = place_of(f)
        box = whole_group(1.0)[int(place[FACE])]
        assert (np.abs(place[MIDDLE] - box[MIDDLE]) <= box[SIDES] + 1e-15).all()
        assert np.abs(place[MIDDLE][::2] + 1j * place[MIDDLE][1::2]).max() <= 1 + 1e-15


def test_the_form_is_the_bound_on_h():
    """V / k = -2 h / (1 + |h|^2), and k + v.m the square of the length of A psi."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        f = random_mobius(rng, reflect=False)
        place = place_of(f)
        a = np.zeros(8)
        face = int(place[FACE])
        a[2 * face] = 1
        a[np.stack([2 * FREE[face], 2 * FREE[face] + 1], axis=1).ravel()] = place[MIDDLE]
        k, v = polar(a, a)
        h = np.array(f.h)
        assert np.abs(v / k + 2 * h / (1 + h @ h)).max() < 1e-13
        m = sphere_points(rng, 9)
        # the factor by which lengths grow is det A over the square of the length of A psi
        ratio = (k + m @ v) * f.derivative(m)
        assert np.ptp(ratio) < 1e-12 * ratio.max()


def test_compiled_bounds_are_those_of_numpy():
    for number in range(40):
        rng = np.random.default_rng(number)
        problem, planted, h_max = cornered_problem(rng)
        boxes = boxes_around(rng, planted, h_max, 30)[0]
        expected = bounds_of(problem, boxes, most_of(h_max))
        for library in libraries().values():
            with kernels_of(library):
                kernels = CompiledBoxKernels(problem, h_max, SMALLEST_CELL)
            # where rounding decides they may differ
            assert (kernels.bounds(boxes) == expected).mean() > 0.9


def test_pairs_are_the_same_kept_or_computed(monkeypatch):
    rng = np.random.default_rng(4)
    m, b = sphere_points(rng, 30), sphere_points(rng, 90)
    boxes = new_boxes(200)
    boxes[:, MIDDLE], boxes[:, SIDES] = rng.uniform(-0.4, 0.4, (200, 6)), 10.0 ** rng.uniform(-4, -1, (200, 1))
    boxes[:, FACE] = rng.integers(0, 4, 200)
    for weights in (None, rng.random((30, 90)) * (rng.random((30, 90)) < 0.5)):
        problem = sphere_matching(m, b, 0.1, weights=weights)
        kept = CompiledBoxKernels(problem, 0.9, SMALLEST_CELL).bounds(boxes)
        with monkeypatch.context() as patch:
            patch.setattr(sys.modules["solver.search.kernels.box_kernels"], "MOST_HELD", 10)
            assert (CompiledBoxKernels(problem, 0.9, SMALLEST_CELL).bounds(boxes) == kept).all()
        assert (kept > 0).any()


def test_at_a_point_bound_and_value_are_the_same():
    rng = np.random.default_rng(2)
    for _ in range(20):
        source, target = sphere_points(rng, 8), sphere_points(rng, 9)
        problem = sphere_matching(source, target, rng.uniform(0.1, 0.8, 9), weights=rng.integers(0, 5, (8, 9)) / 4)
        kernels = CompiledBoxKernels(problem, 0.9, SMALLEST_CELL)
        known = [random_mobius(rng, reflect=False) for _ in range(10)]
        boxes = np.array([place_of(f) for f in known])
        values = np.array([problem.value(f) for f in known])
        assert (bounds_of(problem, boxes, most_of(0.9)) == values).all()
        assert (kernels.bounds(boxes) == values).all()


def test_a_bound_is_exact_to_first_order():
    """Of one pair and a small box, some transformation on its rim comes as near as the bound says."""
    rng = np.random.default_rng(6)
    for _ in range(30):
        f, m = random_mobius(rng, 0.3, reflect=False), sphere_points(rng, 1)
        place, half = place_of(f), 1e-4
        box = place.copy()
        box[SIDES] = half
        b = unit(f(m) + 0.02 * sphere_points(rng, 1))
        corners = np.repeat(place[None], 64, axis=0)
        corners[:, MIDDLE] += half * np.array([[1 - 2 * (i >> k & 1) for k in range(6)] for i in range(64)])
        nearest = min(np.linalg.norm(transformation(c)(m) - b) for c in corners)
        reach = np.linalg.norm(f(m) - b) - nearest
        for share, alive in ((0.98, False), (1.02, True)):
            problem = sphere_matching(m, b, np.linalg.norm(f(m) - b) - reach / share)
            assert (bounds_of(problem, box[None], 1.0)[0] > 0) == alive


def test_spinors_are_the_points():
    rng = np.random.default_rng(7)
    x = np.concatenate([sphere_points(rng, 50), [[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]])
    psi = spinors(x)
    product = psi[:, :, None] * np.conj(psi[:, None])
    assert np.abs(2 * product[:, 0, 1] - (x[:, 0] - 1j * x[:, 1])).max() < 1e-15
    assert np.abs(product[:, 0, 0] - product[:, 1, 1] - x[:, 2]).max() < 1e-15
    assert np.abs(product[:, 0, 0] + product[:, 1, 1] - 1).max() < 1e-15


def test_halves_are_the_whole():
    rng = np.random.default_rng(8)
    boxes = new_boxes(50)
    boxes[:, MIDDLE], boxes[:, SIDES] = rng.uniform(-1, 1, (50, 6)), rng.choice([0.25, 0.5], (50, 6))
    halves = halved(boxes).reshape(50, 2, -1)
    assert (halves[:, :, SIDES].prod(axis=2).sum(axis=1) == boxes[:, SIDES].prod(axis=1)).all()
    ends = [halves[:, k, MIDDLE] + sign * halves[:, k, SIDES] for k, sign in ((0, -1), (1, 1))]
    assert np.allclose(ends[0], boxes[:, MIDDLE] - boxes[:, SIDES])
    assert np.allclose(ends[1], boxes[:, MIDDLE] + boxes[:, SIDES])


def test_three_points_determine_a_transformation():
    rng = np.random.default_rng(9)
    for _ in range(20):
        f, m = random_mobius(rng, 0.3, reflect=False), sphere_points(rng, 4)
        b = spinors(f(m))
        found = transformation(points(through(spinors(m)[:3], *(b[None, k] for k in range(3))))[0])
        assert np.abs(found(m) - f(m)).max() < 1e-9


def test_one_of_the_seeds_is_what_is_planted():
    rng = np.random.default_rng(10)
    m = sphere_points(rng, 12)
    f = SphereMobius((0.1, 0.05, -0.1), (1, 2, 3, 4))
    problem = sphere_matching(m, f(m)[rng.permutation(12)], 0.01)
    kernels = CompiledBoxKernels(problem, 0.2, SMALLEST_CELL)
    assert max(kernels.bounds(points(some)).max() for some in seeds(problem, 0.2)) == 12
