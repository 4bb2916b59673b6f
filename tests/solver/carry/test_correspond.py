from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, percent, places, posed, remeshed

from solver import AlignSettings, Mobius, TriangleMesh, align, correspond

SMALL = AlignSettings(samples=40, targets=300, reflect="never")


@pytest.fixture(scope="module")
def pair():
    """A sheet, its posed and remeshed self with a loose vertex in front, and their correspondence."""
    source = bumps(900, seed=2)
    target, vertex = remeshed(posed(source, 1), 0.6, 2)
    loose = TriangleMesh(np.vstack([[[7, 7, 7]], target.vertices]), target.faces + 1)
    alignment = align(source, loose, SMALL)
    return source, vertex, alignment, correspond(alignment)


def test_every_vertex_in_use_has_a_place(pair):
    _, _, _, found = pair
    assert found.face[0] == -1
    assert not found.matched[0]
    assert found.confidence[0] == 0
    assert (found.face[1:] >= 0).all()
    assert (found.barycentric >= 0).all()
    assert found.barycentric[1:].sum(axis=1) == pytest.approx(1)
    assert ((found.confidence >= 0) & (found.confidence <= 1)).all()


def test_the_matrix_carries_values(pair):
    source, _, _, found = pair
    matrix = found.matrix()
    assert matrix.shape == (len(found.face), len(source.vertices))
    assert matrix.sum(axis=1)[1:] == pytest.approx(1)
    assert matrix.sum(axis=1)[0] == 0
    corner = source.vertices[source.faces[found.face[5]]]
    assert (matrix @ source.vertices)[5] == pytest.approx(found.barycentric[5] @ corner)


def test_places_are_right_and_trusted(pair):
    source, vertex, _, found = pair
    error = percent(places(found, source)[1:], source.vertices[vertex], source)
    assert error.mean() < 0.7
    assert found.matched[1:].mean() > 0.9


def test_a_wrong_map_is_not_trusted(pair):
    """Turned by a right angle, hills lie on dents."""
    _, _, alignment, found = pair
    turned = correspond(replace(alignment, mobius=Mobius(0, np.pi / 2) @ alignment.mobius, bending=None))
    assert turned.confidence.mean() < 0.75 * found.confidence.mean()
    assert turned.matched.mean() < found.matched.mean() - 0.15
