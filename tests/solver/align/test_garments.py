"""Sleeves, socks, belts and scarfs, worn in two ways: a right map, or a word that it may be wrong."""

from dataclasses import replace

import numpy as np
import pytest
from garments import Form, band_form, ring_form, tube_form, woven
from scans import percent, places, posed

from solver import Alignment, AlignSettings, MeshError, align, correspond
from solver.align.doubt.decision import FITS
from solver.align.judgement import judge

QUICK = AlignSettings(samples=60, targets=500, reflect="never")


def worn(
    form: Form, other: Form, rows: int, columns: int, angle: float, *, tube: bool, settings: AlignSettings = QUICK
) -> tuple[Alignment, np.ndarray]:
    """Align a thing with itself, bent, woven otherwise and posed; and the errors in % of the diagonal."""
    source = woven(form, rows, columns, 0.0, 1, tube=tube)[0]
    target, place = woven(other, round(0.85 * rows), round(0.85 * columns), angle, 2, tube=tube)
    found = align(source, posed(target, 3), settings)
    there = correspond(found)
    return found, percent(places(there, source), form(place[:, 0], place[:, 1], 0.0), source)


@pytest.mark.parametrize(
    ("form", "rows", "columns", "tube"),
    [
        (tube_form(8, seed=1), 64, 26, True),
        (tube_form(6, 0.8, seed=3, closed=True), 56, 26, True),
        (band_form(6, seed=1), 84, 15, False),
        (ring_form(8, seed=1), 11, 90, True),
    ],
    ids=["sleeve", "sock", "scarf", "belt"],
)
def test_a_garment_is_aligned_with_itself_worn_otherwise(form: Form, rows: int, columns: int, tube: bool) -> None:
    found, errors = worn(form, form, rows, columns, 0.6, tube=tube)
    assert judge(found).level != "doubtful"
    assert errors.mean() < 1.5


def test_a_tube_has_either_end_for_its_outer_boundary() -> None:
    """Where the ends are about as long as each other, and the longer one is the other one on the target."""
    found, errors = worn(tube_form(8, 0.9, seed=2), tube_form(8, 1.1, seed=2), 64, 28, 0.3, tube=True)
    assert any("another opening than the longest taken for its outer boundary" in said for said in found.warnings)
    assert judge(found).level != "doubtful"
    assert errors.mean() < 1.0


def test_a_named_end_stays() -> None:
    source = woven(tube_form(6, 0.9, seed=2), 40, 20, 0.0, 1, tube=True)[0]
    target = woven(tube_form(6, 1.1, seed=2), 36, 18, 0.3, 2, tube=True)[0]
    rim = np.arange(18)
    found = align(source, target, AlignSettings(samples=60, targets=400, reflect="never", target_outer=3))
    assert set(found.target.boundary) == set(rim)
    assert not any("another opening" in said for said in found.warnings)
    assert found.source.boundary.size == 20


@pytest.mark.parametrize("length", [16, 60])
def test_a_scarf_too_long_for_a_disc_is_refused(length: int) -> None:
    scarf = woven(band_form(length), 8 * length, 9, 0.0, 1, tube=False)[0]
    with pytest.raises(MeshError, match=r"^'Cloth' is too long and narrow to be aligned in a disc"):
        align(scarf, scarf, QUICK)


@pytest.mark.parametrize("length", [75, 150])
def test_a_tube_too_long_for_a_disc_is_refused(length: int) -> None:
    tube = woven(tube_form(length, 1.0), 6 * length, 16, 0.0, 1, tube=True)[0]
    with pytest.raises(MeshError, match=r"^'Cloth' is too deep or too long for a disc"):
        align(tube, tube, QUICK)


def test_a_tube_that_is_not_sure_is_said_to_be_deep() -> None:
    """Nearly half of it shrinks to nothing: where the map is not sure all over, the reason is named."""
    found, _ = worn(tube_form(16), tube_form(16), 80, 20, 2.4, tube=True, settings=replace(QUICK, time_limit=5.0))
    assert found.mean_confidence < FITS
    assert "deep" in found.causes
    assert any("'Cloth' is deep, " in said for said in found.warnings)
