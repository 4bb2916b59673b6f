"""Damaged scans: the same map as of the clean ones, or a refusal by name; never another map without a word."""

from collections.abc import Callable

import numpy as np
import pytest
from damages import (
    DAMAGES,
    Clean,
    Damage,
    bow_ties,
    closed_lips,
    coarse_numbers,
    extreme_size,
    handle,
    inside_out,
    mirror_halves,
    spikes,
    two_sides,
    undamaged,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scans import bumps, posed, remeshed

from solver import AlignSettings, TriangleMesh, align, correspond, prepare

QUICK = AlignSettings(samples=50, targets=400, reflect="never", refine="mobius", time_limit=None)


@pytest.fixture(scope="module")
def pair() -> Clean:
    sheet = bumps(900, seed=2)
    return Clean(sheet, remeshed(posed(sheet, 1), 0.7, 2)[0], QUICK)


# which side is out only the dense map tells
PLAIN = [x for x in DAMAGES if x not in (inside_out, mirror_halves)]
alone = st.tuples(st.sampled_from(PLAIN))
both = st.lists(st.sampled_from(PLAIN), min_size=2, max_size=2, unique=True).filter(
    lambda flaws: not {extreme_size, coarse_numbers} <= set(flaws)  # single precision has no such sizes
)


@settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(
    flaws=st.one_of(alone, both.map(tuple)),
    side=st.sampled_from(["source", "target"]),
    seed=st.integers(0, 1 << 20),
)
def test_a_damaged_pair_has_the_map_of_the_clean_one(
    pair: Clean, flaws: tuple[Damage, ...], side: str, seed: int
) -> None:
    found = pair.outcome(flaws, side, seed)
    assert found.kind in ("same", "refused"), found
    if found.kind == "refused":
        assert coarse_numbers in flaws, found
        assert found.text.startswith("'bumps' lies so far from the origin")


@pytest.mark.parametrize(
    "damage", [inside_out, mirror_halves, spikes, two_sides, extreme_size], ids=lambda x: x.__name__
)
@pytest.mark.parametrize("side", ["source", "target"])
def test_what_turns_the_whole_surface_is_found_by_the_dense_map(damage: Damage, side: str) -> None:
    sheet = bumps(900, seed=5)
    dense = AlignSettings(samples=60, targets=500, time_limit=None)
    pair = Clean(sheet, remeshed(posed(sheet, 3), 0.7, 4)[0], dense)
    found = pair.outcome([damage], side, 1)
    assert found.kind == "same", found
    if damage is inside_out:
        assert "seems to be inside out beside" in found.text


def test_real_scans_with_flaws(real_mesh: Callable[[str], TriangleMesh]) -> None:
    source, target = (real_mesh(f"faces_simpop/SIMPOP_{k}.obj") for k in ("01", "10"))
    pair = Clean(source, posed(target, 2), QUICK)
    for number, damage in enumerate(PLAIN[::2]):
        found = pair.outcome([damage], ("source", "target")[number % 2], number)
        assert found.kind == "same" or (damage is coarse_numbers and found.kind == "refused"), (damage, found)


@pytest.mark.parametrize("side", ["source", "target"])
@pytest.mark.parametrize("other", [None, bow_ties, handle], ids=["alone", "bow ties", "handle"])
def test_lips_are_joined_beside_a_surface_without_an_opening(pair: Clean, side: str, other: Damage | None) -> None:
    found = pair.outcome([closed_lips] if other is None else [closed_lips, other], side, 5)
    assert found.kind == "same", found
    assert "that a shape key opens joined, as 'bumps' has no opening" in found.text


def test_lips_stay_apart_beside_a_mouth() -> None:
    """Where the other surface has an opening too, the lips are what belongs to it."""
    rng = np.random.default_rng(5)
    lips = closed_lips(undamaged(bumps(900, seed=2)), rng)
    alignment = align(*[prepare(lips.mesh, QUICK, keys=lips.keys) for _ in range(2)], QUICK)
    assert not any("shape key" in said for said in alignment.warnings)
    assert len(alignment.source.holes) == len(alignment.target.holes) == 1
    found = correspond(alignment)
    nearest = found.source_triangles[found.face, found.barycentric.argmax(axis=1)]
    assert np.array_equal(nearest, np.arange(len(lips.clean)))


def test_what_is_told_of_a_damaged_target_is_told_of_its_own_vertices(pair: Clean) -> None:
    """As many rows as vertices, and vertices that became one have one place."""
    from damages import loose_triangles

    from solver import report

    new = loose_triangles(undamaged(pair.target), np.random.default_rng(0))
    alignment = align(pair.source, new.mesh, QUICK)
    found = correspond(alignment)
    assert len(found.face) == len(new.mesh.vertices)
    places = found.matrix() @ pair.source.vertices
    order = np.argsort(new.clean, kind="stable")
    same = new.clean[order[1:]] == new.clean[order[:-1]]
    assert (places[order[1:]][same] == places[order[:-1]][same]).all()
    clean = correspond(align(pair.source, pair.target, QUICK))
    figures = report(alignment, found)
    assert figures["coverage"] == pytest.approx(
        report(align(pair.source, pair.target, QUICK), clean)["coverage"], abs=0.01
    )
