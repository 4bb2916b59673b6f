"""Whether a map can be believed: one word from confidence, coverage and warnings."""

import ast
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver
from solver.align.confidence import BOUND, expected_error
from solver.align.judgement import concern, judge, judged
from tests.solver.scans import bumps

DOUBT = "doubtful: more likely than not the map errs by more than 2 % of the source's diagonal"
TIE = "ambiguous orientation: mirrored and not mirrored differ by 1.0 % of the samples; taken as not mirrored"
OPENING = "'A': 2 openings (12, 9 edges) closed, for the computation only"
PARTIAL = "partial overlap: 20 % of the target without a counterpart on the other surface"
ORDER = ["good", "check", "doubtful"]

shares = st.floats(0, 1)
sentences = st.lists(st.sampled_from([DOUBT, TIE, OPENING, PARTIAL, "in the overlap: " + TIE, "something new"]))


@pytest.mark.parametrize(
    ("confidence", "coverage", "warnings", "level"),
    [
        (0.97, 1.0, [], "good"),
        (0.97, 0.8, [OPENING, PARTIAL], "good"),
        (0.97, 0.6, [PARTIAL], "check"),
        (0.7, 1.0, [], "check"),
        (0.97, 1.0, [TIE], "check"),
        (0.97, 1.0, ["in the overlap: " + TIE], "check"),
        (0.97, 1.0, ["a sentence that nobody has thought of"], "check"),
        (0.5, 1.0, [], "doubtful"),
        (0.97, 0.0, [], "doubtful"),
        (0.97, 1.0, [DOUBT], "doubtful"),
    ],
)
def test_the_level(confidence: float, coverage: float, warnings: list[str], level: str) -> None:
    assert judged(confidence, coverage, warnings).level == level


@given(shares, shares, sentences, st.sampled_from([DOUBT, TIE, OPENING]), shares, shares)
def test_less_certainty_and_more_warnings_never_make_it_better(
    confidence: float, coverage: float, warnings: list[str], more: str, less: float, fewer: float
) -> None:
    before = judged(confidence, coverage, warnings)
    for worse in (
        judged(confidence * less, coverage, warnings),
        judged(confidence, coverage * fewer, warnings),
        judged(confidence, coverage, [*warnings, more]),
    ):
        assert ORDER.index(worse.level) >= ORDER.index(before.level)
    # nothing is said twice, and nothing is lost
    said = [*before.notes, *(one.text for one in before.concerns)]
    assert len(said) == len(set(said))
    assert set(said) == {text.removeprefix("in the overlap: ") for text in warnings}


def test_the_kind_is_told_without_what_leads_to_the_sentence() -> None:
    found = concern("doubtful, perhaps because 'A' is rough or noisy: smooth or remesh it")
    assert (found.kind, found.text) == ("rough", "'A' is rough or noisy: smooth or remesh it")
    assert concern("in the overlap: not proved optimal: a value up to 1.0 % larger was not").kind == "unproved"


SPEAKERS = {
    "pipeline.py": 2, "mobius_map.py": 3, "reconsider.py": 3, "diagnosis.py": 8, "inside_out.py": 1, "dense.py": 1,
    "pieces.py": 1, "landmarks.py": 1, "whole.py": 2, "other_rim.py": 1,
}  # fmt: skip
"""How many sentences each module of `solver.align` says at least."""


def test_what_the_aligner_says_is_of_a_known_kind() -> None:
    folder = Path(solver.__file__).parent / "align"
    for name, least in SPEAKERS.items():
        texts = [_text(node) for node in ast.walk(ast.parse((folder / name).read_text(encoding="utf-8")))]
        said = [text for text in texts if text.count(" ") >= 4 and not text.endswith(".") and "\n" not in text]
        kinds = [concern(text).kind for text in said]
        assert sum(kind != "other" for kind in kinds) >= least, (name, list(zip(kinds, said, strict=True)))


def _text(node: ast.AST) -> str:
    """Return a text as it looks with figures filled in; nothing of what is no text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(x.value) if isinstance(x, ast.Constant) else "7" for x in node.values)
    return ""


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
