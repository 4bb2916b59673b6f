"""Nothing at the edge of what is allowed makes a bound or a value wrong; tests/bench/adversarial.py tries more."""

import numpy as np
import pytest
from attacks import attack, cells_of, cornered_problem, searched, violations
from hypothesis import given, settings
from hypothesis import strategies as st
from instances import grown

SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=80, deadline=None)
@given(SEEDS)
def test_no_bound_is_below_a_value_in_its_cell(seed):
    counts = cells_of(seed, 60)
    assert violations(counts) == {}
    assert counts["cells"] > 0


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_no_search_claims_what_does_not_hold_exactly(seed):
    assert violations(searched(seed, time_limit=0.2)) == {}


@pytest.mark.parametrize(("factor", "kinds"), [(1.01, 9), (1 + 1e-6, 7)])
def test_the_attack_would_see_it(factor, kinds):
    """Values of discs that are a little larger than those of the bounds are violations, of sharp kinds at least."""
    seen = set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        problem, planted, z_max = cornered_problem(rng)
        seen |= set(violations(attack(rng, problem, planted, z_max, 60, looser=grown(problem, factor))))
    assert len(seen) >= kinds
