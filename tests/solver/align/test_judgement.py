"""Whether a map can be believed: one word from confidence, coverage and remarks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver
from solver.align.judgement import DONE, judge, judged
from solver.align.result.confidence import BOUND, expected_error
from solver.align.surfaces.remark import Remark
from tests.solver.scans import bumps

DOUBT = Remark("doubtful", "doubtful: more likely than not the map errs by more than 2 % of the source's diagonal")
TIE = Remark("orientation", "ambiguous orientation: mirrored and not mirrored differ by 1.0 % of the samples")
TIE_INSIDE = replace(TIE, before="in the overlap: ")
OPENING = Remark("done", "'A': 2 openings (12, 9 edges) closed, for the computation only")
PARTIAL = Remark("partial", "partial overlap: 20 % of the target without a counterpart on the other surface")
UNKNOWN = Remark("other", "a sentence that nobody has thought of")
ORDER = ["good", "check", "doubtful"]

shares = st.floats(0, 1)
remarks = st.lists(st.sampled_from([DOUBT, TIE, OPENING, PARTIAL, TIE_INSIDE, UNKNOWN]))


@pytest.mark.parametrize(
    ("confidence", "coverage", "said", "level"),
    [
        (0.97, 1.0, [], "good"),
        (0.97, 0.8, [OPENING, PARTIAL], "good"),
        (0.97, 0.6, [PARTIAL], "check"),
        (0.7, 1.0, [], "check"),
        (0.97, 1.0, [TIE], "check"),
        (0.97, 1.0, [TIE_INSIDE], "check"),
        (0.97, 1.0, [UNKNOWN], "check"),
        (0.5, 1.0, [], "doubtful"),
        (0.97, 0.0, [], "doubtful"),
        (0.97, 1.0, [DOUBT], "doubtful"),
    ],
)
def test_the_level(confidence: float, coverage: float, said: list[Remark], level: str) -> None:
    assert judged(confidence, coverage, said).level == level


@given(shares, shares, remarks, st.sampled_from([DOUBT, TIE, OPENING]), shares, shares)
def test_less_certainty_and_more_warnings_never_make_it_better(
    confidence: float, coverage: float, said: list[Remark], more: Remark, less: float, fewer: float
) -> None:
    before = judged(confidence, coverage, said)
    for worse in (
        judged(confidence * less, coverage, said),
        judged(confidence, coverage * fewer, said),
        judged(confidence, coverage, [*said, more]),
    ):
        assert ORDER.index(worse.level) >= ORDER.index(before.level)
    # nothing is said twice, and nothing is lost
    told = [*before.notes, *(one.text for one in before.concerns)]
    assert len(told) == len(set(told))
    assert set(told) == {one.text for one in said}


def test_a_sentence_is_told_with_what_leads_to_it() -> None:
    assert TIE_INSIDE.sentence == f"in the overlap: {TIE.sentence}"
    assert judged(0.9, 1.0, [TIE, TIE_INSIDE]).concerns == (TIE,)


def test_what_the_aligner_says_has_its_kind() -> None:
    """Sides that tie in the search, a rival, an overlap that fits badly: each by what it is, never by its words."""
    fine = bumps(900, seed=4)
    quick = solver.AlignSettings(samples=60, targets=300, time_limit=0.0)
    found = solver.align(fine, bumps(700, seed=9), quick)
    kinds = {one.kind for one in found.remarks}
    assert {"doubtful", "unproved", "unlike"} <= kinds
    assert "other" not in kinds
    assert found.warnings == tuple(one.sentence for one in found.remarks)
    assert set(found.causes) == {one.kind for one in found.remarks if one.before.startswith("doubtful, perhaps")}
    assert all(one.kind not in DONE for one in judge(found).concerns)


def test_an_alignment_is_judged_and_the_report_says_so() -> None:
    one = bumps(900, seed=3)
    found = solver.align(one, one, solver.AlignSettings(samples=60, targets=300))
    told = solver.report(found, solver.correspond(found))
    assert judge(found).level == told["verdict"] == "good"
    assert told["concerns"] == []
    assert 0 < told["expected_error"] < BOUND


def test_the_expected_error_is_that_of_exponentially_distributed_ones() -> None:
    rng = np.random.default_rng(5)
    for scale in (0.002, 0.01, 0.03):
        errors = rng.exponential(scale, 200_000)
        assert expected_error(np.array([(errors < BOUND).mean()]))[0] == pytest.approx(errors.mean(), rel=0.05)
    assert np.isinf(expected_error(np.array([0.0])))[0]
