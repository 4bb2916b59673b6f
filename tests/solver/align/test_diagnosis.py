"""A doubtful map names its likely cause."""

from dataclasses import replace

import numpy as np
import pytest
from damages import Damage, handle, islands, rim_spikes, slit, spikes, undamaged
from scans import bumps, posed

from solver import AlignSettings, TriangleMesh, align, correspond, report
from solver.align.result.confidence import FITTED, unmatched_share

QUICK = AlignSettings(reflect="never")


def test_fewer_samples_count_for_less() -> None:
    """Nothing changes from the number on that the model was fitted to; below, the share that counts only grows."""
    for matched in (0.5, 0.8, 1.0):
        counts = [10, 20, 40, 80, FITTED, 4 * FITTED]
        shares = [unmatched_share(matched * count, count) for count in counts]
        assert shares[-2:] == pytest.approx([1 - matched] * 2)
        assert (np.diff(shares[:-1]) < 0).all()


def test_three_samples_tell_nothing() -> None:
    assert unmatched_share(3, 3) > 0.9


def test_a_coarse_source_is_named_and_less_sure() -> None:
    sheet, fine = bumps(60, seed=3), posed(bumps(1500, seed=3), 1)
    found = align(sheet, fine, QUICK)
    assert len(found.source_samples) < 50
    assert any("is coarse, with" in said and "subdivide it" in said for said in found.warnings)
    assert "coarse" in found.causes
    assert report(found, correspond(found))["causes"] == list(found.causes)
    assert found.mean_confidence < align(bumps(1500, seed=3), fine, QUICK).mean_confidence


def test_two_things_that_are_not_alike_are_said_to_be() -> None:
    dome = bumps(900, seed=5)
    waves = dome.vertices * [1, 1, 0]
    waves[:, 2] = 0.1 * np.sin(11 * waves[:, 0]) * np.sin(9 * waves[:, 1])
    found = align(dome, TriangleMesh(waves, dome.faces, "waves"), QUICK)
    assert any(said.startswith("doubtful: ") for said in found.warnings)
    assert any("are these two of one kind?" in said for said in found.warnings)
    assert {"unlike", "one way"} <= set(found.causes)


@pytest.fixture(scope="module")
def unlike() -> tuple[TriangleMesh, TriangleMesh]:
    """A dome and something else, between which all maps are doubtful."""
    dome = bumps(900, seed=5)
    waves = dome.vertices * [1, 1, 0]
    waves[:, 2] = 0.1 * np.sin(11 * waves[:, 0]) * np.sin(9 * waves[:, 1])
    return dome, TriangleMesh(waves, dome.faces, "waves")


@pytest.mark.parametrize(
    ("damage", "kind"),
    [(slit, "slit"), (islands, "slit"), (spikes, "spike"), (rim_spikes, "spike"), (handle, "handle")],
)
@pytest.mark.parametrize("side", [0, 1])
def test_what_was_mended_is_named_where_the_map_is_doubtful(
    unlike: tuple[TriangleMesh, TriangleMesh], damage: Damage, kind: str, side: int
) -> None:
    pair = list(unlike)
    pair[side] = damage(undamaged(pair[side]), np.random.default_rng(4)).mesh
    found = align(pair[0], pair[1], replace(QUICK, refine="mobius", samples=60, targets=400))
    assert any(said.startswith("doubtful: ") for said in found.warnings)
    assert kind in found.causes
    assert any(said.startswith(f"doubtful, perhaps because '{pair[side].name}' ") for said in found.warnings)
    assert kind not in align(*unlike, replace(QUICK, refine="mobius", samples=60, targets=400)).causes


def test_a_sure_map_names_no_cause() -> None:
    found = align(bumps(900, seed=3), posed(bumps(900, seed=3), 1), QUICK)
    assert found.causes == ()
    assert found.warnings == ()
