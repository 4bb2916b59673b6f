from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, percent, places, posed, remeshed

from solver import Alignment, AlignSettings, Mobius, align, correspond, flatten
from solver.align.maps import pieces
from solver.align.maps.stretched import agrees_better
from solver.align.result.overlap import piece

SETTINGS = AlignSettings(samples=100, targets=400, reflect="never")


def test_a_strip_that_is_missing_is_found_where_samples_do_not_show_it(monkeypatch):
    """One surface cut a twentieth of its width short, less on one side."""
    monkeypatch.setattr(pieces, "_surely_better", lambda *_: False)
    source = bumps(700, seed=1)
    reach = np.linalg.norm(source.vertices[:, :2], axis=1)
    part = piece(flatten(source), reach < 0.93 + 0.05 * source.vertices[:, 0])
    assert part is not None
    target, vertex = remeshed(posed(part.mesh, 1), 0.8, 2)
    found = align(source, target, SETTINGS)
    assert found.overlap is not None
    assert 0.8 < found.overlap.source_share < 0.95
    assert percent(places(correspond(found), source), source.vertices[part.vertices[vertex]], source).mean() < 0.1


@pytest.fixture(scope="module")
def right_and_turned() -> tuple[Alignment, Alignment]:
    """A map of a surface onto itself, and one turned by 5 degrees."""
    source = bumps(700, seed=3)
    found = align(source, remeshed(posed(source, 1), 0.8, 2)[0], SETTINGS)
    assert found.bending is not None
    turned = replace(found.bending, carried=Mobius(0j, np.radians(5))(found.bending.carried))
    return found, replace(found, bending=turned)


def test_the_map_by_which_descriptors_agree_is_taken(right_and_turned):
    right, turned = right_and_turned
    assert agrees_better(right, turned)
    assert not agrees_better(turned, right)
    assert not agrees_better(right, right)


def test_beside_a_doubtful_map_nothing_is_said(right_and_turned, monkeypatch):
    monkeypatch.setattr(Alignment, "mean_confidence", 0.3)
    assert not agrees_better(*right_and_turned)
