from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, posed, remeshed

from solver import AlignSettings, align
from solver.align.doubt.chances import expected, promised
from solver.align.maps.dense import begun
from solver.stages import Stages


def test_samples_promise_less_the_fewer_match():
    shares = [promised(matched, 100) for matched in range(0, 101, 10)]
    assert (np.diff(shares) > 0).all()
    assert shares[0] < 0.05
    assert shares[-1] > 0.95


def test_a_draft_by_few_vertices_lets_expect_what_the_bent_map_makes_sure():
    """Of the right map, and of a wrong one with its samples: it may not be said that this one cannot be right."""
    source = bumps(900, seed=2)
    found = align(source, remeshed(posed(source, 1), 0.6, 2)[0], AlignSettings(samples=60, targets=400))
    clock = Stages(None).part(0, 1)
    right = replace(found, bending=None, counterpart=None)
    sure = found.confidence @ found.target.mesh.vertex_areas / found.target.mesh.area
    assert expected(right, begun(right, clock, None, 300, None)) == pytest.approx(sure, abs=0.05)
    wrong = replace(right, mobius=replace(found.mobius, theta=found.mobius.theta + 2.0))
    assert expected(wrong, begun(wrong, clock, None, 300, None)) < sure
