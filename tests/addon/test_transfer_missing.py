"""Values that are no finite numbers: never written, and said."""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import make_sheet, positions, weights
from test_attributes import EVERY_ROW, correspondence, flat
from test_transfer_rules import add_group, carry
from test_transfer_shape_keys import add_key, shape

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402

N = 5
COUNT = N * N
FLOAT_ROWS = [row for row in EVERY_ROW if row.access.dtype == "float32" and row.access.data_type != "BYTE_COLOR"]
NONE = st.sampled_from([np.nan, np.inf, -np.inf])


def values_of(obj: Any, row: Any, name: str) -> np.ndarray:
    return row.access.read(obj, name).reshape(-1, row.access.width)


@pytest.mark.parametrize("row", FLOAT_ROWS, ids=lambda row: f"{row.access.data_type}-{row.access.domain}")
@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(bad=st.sets(st.integers(0, COUNT - 1), min_size=1, max_size=COUNT), what=NONE, finer=st.booleans())
def test_no_layer_gets_a_value_that_is_none(
    empty_scene: Any, row: Any, bad: set[int], what: float, finer: bool
) -> None:
    """Some elements of the source have none: no element of the target gets it, the others as without."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    source = make_sheet("Source", N, flat)
    targets = [make_sheet(name, 8 if finer else N, flat) for name in ("Target", "Other")]
    rng = np.random.default_rng(0)
    access = row.access
    attribute = source.data.attributes.new("Data", access.data_type, access.domain)
    count = len(attribute.data)
    good = (1 + rng.random((count, access.width))).astype(np.float32)
    broken = good.copy()
    chosen = sorted(index % count for index in bad)
    broken[chosen, 0] = what
    plans = []
    for target, values in zip(targets, (broken, good), strict=True):
        source.data.attributes["Data"].data.foreach_set(access.prop, values.ravel())
        plans.append(carry(source, target, kinds=(row.kind,)))
    arrived, whole = (values_of(target, row, "Data") for target in targets)
    assert np.isfinite(arrived).all()
    number = len(set(chosen))
    assert len(plans[0].warnings) == 1
    assert plans[0].warnings[0].startswith("'Data' of the ")
    assert f" of 'Source' is no finite number at {number} " in plans[0].warnings[0]
    assert plans[1].warnings == ()
    if not finer and access.domain in ("POINT", "FACE"):
        missing = np.isin(np.arange(count), chosen)
        assert np.allclose(arrived[~missing], whole[~missing], atol=1e-6)
        targets[0].data.attributes.new("Fresh", access.data_type, access.domain)
        assert (arrived[missing] == values_of(targets[0], row, "Fresh")[missing]).all()


def test_a_shape_with_a_hole_is_carried_around_it_and_the_hole_does_not_move() -> None:
    source, target = make_sheet("Source", N, flat), make_sheet("Target", N, flat)
    moved = np.full((COUNT, 3), 0.25)
    moved[[7, 12]] = np.nan
    add_key(source, "Bad", moved)
    plan = carry(source, target)
    assert plan.warnings == ("'Bad' of the shape keys of 'Source' is no finite number at 2 vertices: that is left out",)
    arrived = shape(target, "Bad") - positions(target)
    assert np.allclose(arrived, np.where(np.isnan(moved), 0, 0.25), atol=1e-6)


def test_numbers_beyond_single_precision_on_their_way_are_left_out() -> None:
    """The target is a thousand times as large: a shape of 1e37 would be one of 1e40."""
    source, target = make_sheet("Source", N, flat), make_sheet("Target", N, flat)
    moved = np.zeros((COUNT, 3))
    moved[3] = 1e37
    add_key(source, "Far", moved)
    found = positions(target)
    target.data.vertices.foreach_set("co", (1000 * found).astype(np.float32).ravel())
    way = Carrier(correspondence(source, found), read_surface(source), read_surface(target))
    plan_transfer(source, target, way, TransferSettings(kinds=("shape-keys",))).write(target)
    assert np.isfinite(shape(target, "Far")).all()


def test_what_is_none_on_the_target_is_not_mixed_in() -> None:
    source, target = make_sheet("Source", N, flat), make_sheet("Target", N, flat)
    for obj, value in ((source, 0.5), (target, 0.25)):
        obj.data.attributes.new("Heat", "FLOAT", "POINT").data.foreach_set("value", np.full(COUNT, value, np.float32))
        add_group(obj, "Head", value)
    target.data.attributes["Heat"].data[4].value = np.nan
    carry(source, target, mix="add", mix_factor=0.5)
    heat = np.array([x.value for x in target.data.attributes["Heat"].data])
    assert heat[4] == pytest.approx(0.25)
    assert np.delete(heat, 4) == pytest.approx(0.5)
    assert weights(target, "Head") == pytest.approx(0.5)
