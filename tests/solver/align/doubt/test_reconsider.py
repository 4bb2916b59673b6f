from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, posed, remeshed

from solver import AlignSettings, align
from solver.align.doubt.decision import MIRRORED, decided
from solver.align.doubt.hypotheses import Hypothesis, by_pose
from solver.align.doubt.reconsider import _screened, in_doubt
from solver.align.maps.dense import drafted_from
from solver.bend.draft import drafted
from solver.stages import Stages

SMALL = AlignSettings(samples=60, targets=400, reflect="auto")


@pytest.fixture(scope="module")
def found():
    source = bumps(900, seed=2)
    return align(source, remeshed(posed(source, 1), 0.6, 2)[0], SMALL)


def said(found, sure: float, *, reflected: bool):
    """The alignment with a map of which so much is sure everywhere."""
    result = replace(found, mobius=replace(found.mobius, reflected=reflected), remarks=())
    result.__dict__["confidence"] = np.full(len(found.target.disc), sure)
    return result


@pytest.mark.parametrize(
    ("plain", "mirrored", "taken", "open_"),
    [
        (0.9, 0.9, False, False),
        (0.6, 0.6 * MIRRORED - 0.01, False, True),
        (0.6, 0.6 * MIRRORED + 0.01, True, False),
        (0.6, 0.6, False, True),
        (0.6, 0.5, False, False),
        (0.8, 0.99, False, True),
        (0.4, 0.9, True, False),
    ],
)
def test_mirrored_is_taken_by_proof_alone(found, plain, mirrored, taken, open_):
    """Clearly better than a map that does not fit; whichever of the two the search preferred."""
    one, two = said(found, plain, reflected=False), said(found, mirrored, reflected=True)
    for bent in ([(one, ""), (two, "the mirrored one")], [(two, ""), (one, "the one that is not mirrored")]):
        best = decided(bent)
        assert best.mobius.reflected == taken
        assert any(text.startswith("ambiguous orientation: ") for text in best.warnings) == open_
        assert any(text.startswith("reconsidered: ") for text in best.warnings) == (
            bent[0][0] is not (two if taken else one)
        )


def test_of_one_orientation_another_is_taken_where_the_first_does_not_fit(found):
    poor, first, fits, more = (said(found, sure, reflected=False) for sure in (0.4, 0.7, 0.8, 0.9))
    for one, two, other in ((first, fits, True), (fits, more, False), (poor, first, True)):
        assert any("than x, which" in text for text in decided([(one, ""), (two, "x")]).warnings) == other


def test_a_right_map_is_not_in_doubt(found):
    assert not in_doubt(found)
    assert in_doubt(said(found, 0.99, reflected=True))
    assert in_doubt(said(found, 0.7, reflected=False))
    assert not any("reconsider" in stage for stage in found.seconds)


def test_a_rigid_pose_implies_the_right_map(found):
    """Found without the search's map: the Möbius transformation, and where the bending begins."""
    onto = drafted(found.mobius, found.source, found.target).onto
    wrong = replace(found, mobius=replace(found.mobius, theta=found.mobius.theta + 2.0))
    hypothesis = by_pose(wrong, onto, lambda _: False)
    assert hypothesis is not None
    implied = hypothesis.alignment
    assert not implied.mobius.reflected
    assert np.abs(implied.mobius.z - found.mobius.z) < 0.02
    assert np.abs(np.exp(1j * implied.mobius.theta) - np.exp(1j * found.mobius.theta)) < 0.05
    assert implied.taken is not None
    assert implied.value == pytest.approx(found.value, rel=0.1)
    assert hypothesis.start is not None
    assert hypothesis.start.shape == found.target.mesh.vertices.shape


def test_few_vertices_show_which_hypotheses_are_lost(found):
    """The right one is left beside a wrong first map; none beside the right one, which is no hypothesis once more."""
    right = replace(found, bending=None, counterpart=None)
    wrong = replace(right, mobius=replace(found.mobius, theta=found.mobius.theta + 2.0))
    clock = Stages(None).part(0, 1)
    tried = [Hypothesis(one, None, name) for one, name in ((right, "right"), (wrong, "wrong"))]
    for first, left in ((wrong, ["right"]), (right, [])):
        likely = _screened(found, first, drafted_from(first, clock), tried, clock)
        assert [one.what for one in likely] == left
