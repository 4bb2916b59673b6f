from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, percent, places, posed, remeshed

from solver import AlignSettings, Mobius, align, correspond
from solver.align.result.confidence import BOUND, COLUMNS, DENSE, MOBIUS

SMALL = AlignSettings(samples=60, targets=400, reflect="never")


@pytest.fixture(scope="module")
def found():
    source = bumps(900, seed=2)
    target, vertex = remeshed(posed(source, 1), 0.6, 2)
    return source, vertex, align(source, target, SMALL)


def test_evidence_is_never_negative_and_speaks_against(found):
    _, _, alignment = found
    seen = alignment.evidence
    assert seen.shape == (len(alignment.target.disc), len(COLUMNS))
    assert np.isfinite(seen).all()
    assert (seen >= 0).all()
    for coefficients in (DENSE, MOBIUS):
        assert coefficients.shape == (len(COLUMNS),)
        assert (coefficients[1:] <= 0).all()


def test_it_is_a_probability_that_a_right_map_bears_out(found):
    source, vertex, alignment = found
    good = percent(places(correspond(alignment), source), source.vertices[vertex], source) < 100 * BOUND
    said = alignment.confidence
    assert ((said >= 0) & (said <= 1)).all()
    assert good.mean() > 0.95
    assert said.mean() > 0.6
    assert not any(warning.startswith("doubtful") for warning in alignment.warnings)


def test_a_wrong_map_is_doubted(found):
    """The best rival sends everything elsewhere; turned by a right angle, hills lie on dents."""
    _, _, alignment = found
    before = replace(alignment, bending=None)
    assert before.rival is not None
    rival = replace(before, mobius=before.rival.mobius, taken=before.rival)
    assert rival.confidence.mean() < 0.5 * before.confidence.mean()
    turned = replace(before, mobius=Mobius(0, np.pi / 2) @ alignment.mobius)
    assert turned.confidence.mean() < before.confidence.mean() - 0.15


def test_surfaces_of_two_kinds_are_doubted_aloud():
    alignment = align(bumps(900, seed=2), bumps(900, seed=5), SMALL)
    assert any(warning.startswith("doubtful: ") for warning in alignment.warnings)


def test_nothing_is_claimed_without_a_counterpart(found):
    _, _, alignment = found
    counterpart = np.arange(len(alignment.target.disc)) % 2 == 0
    partly = replace(alignment, counterpart=counterpart)
    assert (partly.confidence[~counterpart] == 0).all()
    assert not correspond(partly).matched[~counterpart].any()
