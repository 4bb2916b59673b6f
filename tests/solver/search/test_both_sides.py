"""Both orientations side by side: the better one as if searched alone, and a bound on the other that holds."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Mobius
from solver.search.both_sides import search_both
from solver.search.branch_and_bound import search
from solver.search.matching import Objective


def instance(seed: int, like: float) -> Objective:
    """Points of which some share is mapped by a Möbius transformation, mirrored or not, and random weights."""
    rng = np.random.default_rng(seed)
    source = 0.9 * np.sqrt(rng.random(14)) * np.exp(2j * np.pi * rng.random(14))
    seen = np.conj(source) if seed % 2 else source
    target = Mobius(0.3 - 0.2j, 1.0)(seen)
    lost = rng.random(14) > like
    target[lost] = 0.9 * np.sqrt(rng.random(lost.sum())) * np.exp(2j * np.pi * rng.random(lost.sum()))
    return Objective(source, target, np.full(14, 0.08), 0.5 + 0.5 * rng.random((14, 14)))


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.4, 0.8]), st.sampled_from([0.0, 0.7, 3.0, 20.0]))
def test_the_better_one_is_found_and_the_other_is_bounded(seed: int, like: float, margin: float) -> None:
    problem = instance(seed, like)
    found = search_both(problem, z_max=0.8, margin=margin, threads=1)
    whole = [
        search(x, problem.target, problem.radius, weights=problem.weights, z_max=0.8, threads=1)
        for x in (problem.source, np.conj(problem.source))
    ]
    best = max(x.value for x in whole)
    for one, alone in zip(found, whole, strict=True):
        assert alone.certified
        assert one.value <= alone.value <= one.upper_bound
        if alone.value > best - margin:
            assert (one.value, one.certified) == (alone.value, True)
        else:
            assert one.upper_bound <= best - margin
    # no more cells than two searches, but for a round's difference
    assert sum(x.nodes for x in found) <= 1.5 * sum(x.nodes for x in whole) + 500


def test_it_ends_in_time_and_when_it_is_called_off() -> None:
    rng = np.random.default_rng(0)
    points = 0.9 * np.sqrt(rng.random((2, 120))) * np.exp(2j * np.pi * rng.random((2, 120)))
    hard = Objective(points[0], points[1], np.full(120, 0.15), rng.random((120, 120)))
    begun = time.perf_counter()
    late = search_both(hard, z_max=0.95, margin=1.0, time_limit=0.2, threads=1)
    assert time.perf_counter() - begun < 5
    assert all(x.out_of_time and not x.certified and x.value <= x.upper_bound for x in late)
    ended = search_both(hard, z_max=0.95, margin=1.0, progress=lambda now: now.seconds < 0.1, threads=1)
    assert all(x.cancelled for x in ended)
    with pytest.raises(ValueError, match="above 0"):
        search_both(Objective(points[0], points[1], np.full(120, -1.0), hard.weights), z_max=0.9, margin=1.0)
