"""Scans with openings in `align` and `correspond`."""

from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, percent, places, posed, remeshed

from solver import AlignSettings, MeshError, TriangleMesh, align, correspond, topology

Pierced = tuple[TriangleMesh, TriangleMesh, np.ndarray]
SMALL = AlignSettings(samples=40, targets=300, reflect="never", fill_holes=True)


@pytest.fixture(scope="module")
def pierced() -> Pierced:
    """A sheet, the same with a round opening, and which of its faces are in that."""
    sheet = bumps(900, seed=2)
    centre = sheet.vertices[sheet.faces].mean(axis=1)
    middle = sheet.vertices[np.argmin(np.linalg.norm(sheet.vertices - sheet.vertices.mean(axis=0), axis=1))]
    inside = np.linalg.norm(centre - middle, axis=1) < 0.12 * sheet.diagonal
    return sheet, TriangleMesh(sheet.vertices, sheet.faces[~inside], "Pierced"), inside


def test_what_lies_in_an_opening_of_the_source_is_not_matched(pierced: Pierced) -> None:
    sheet, open_sheet, inside = pierced
    assert len(topology(open_sheet).boundary_loops) == 2
    target, vertex = remeshed(posed(sheet, 1), 0.6, 2)
    alignment = align(open_sheet, target, SMALL)
    found = correspond(alignment)
    gone = np.isin(vertex, np.setdiff1d(sheet.faces[inside], open_sheet.faces))
    assert gone.sum() > 5
    error = percent(places(found, open_sheet), sheet.vertices[vertex], sheet)
    assert error[~gone].mean() < 1.5
    assert found.matched[gone].mean() < 0.2
    assert found.matched[~gone].mean() > 0.8
    assert (found.face >= 0).all()


def test_an_opening_of_the_target_does_no_harm(pierced: Pierced) -> None:
    sheet, open_sheet, _ = pierced
    found = correspond(align(posed(sheet, 1), open_sheet, SMALL))
    used = np.unique(open_sheet.faces)
    error = percent(places(found, posed(sheet, 1))[used], posed(sheet, 1).vertices[used], sheet)
    assert error.mean() < 1.5


def test_openings_are_refused_on_request(pierced: Pierced) -> None:
    sheet, open_sheet, _ = pierced
    with pytest.raises(MeshError, match="'Pierced' has 2 boundary loops"):
        align(sheet, open_sheet, AlignSettings(samples=40, targets=300, fill_holes=False))


def test_the_outer_loop_can_be_named(pierced: Pierced) -> None:
    sheet, open_sheet, _ = pierced
    inner = topology(open_sheet).boundary_loops[1]
    settings = AlignSettings(samples=12, targets=80, reflect="never", refine="none", fill_holes=True, z_max=0.2)
    named = align(sheet, open_sheet, replace(settings, target_outer=int(inner[0])))
    assert set(named.target.boundary) == set(inner)
    with pytest.raises(MeshError, match="on none of its boundary loops"):
        align(sheet, open_sheet, replace(settings, target_outer=10**6))
