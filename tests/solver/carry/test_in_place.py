"""Surfaces that lie in one place already."""

from dataclasses import replace

import numpy as np
from correspondences import planar_correspondence, sheet

from solver import Correspondence, TriangleMesh
from solver.carry.in_place import settled
from solver.carry.interpolate import places


def lifted(mesh: TriangleMesh) -> TriangleMesh:
    x, y, _ = mesh.vertices.T
    return TriangleMesh(np.stack([x, y, 0.2 * np.sin(3 * x) * np.cos(2 * y)], axis=1), mesh.faces)


def shaken(found: Correspondence, seed: int, size: float) -> Correspondence:
    """Places a little beside the right ones, in their faces."""
    rng = np.random.default_rng(seed)
    place = np.abs(found.barycentric + rng.uniform(0, size, found.barycentric.shape))
    return replace(found, barycentric=place / place.sum(axis=1, keepdims=True))


def test_a_map_that_is_nearly_right_becomes_right_where_the_two_lie_on_each_other() -> None:
    plane = sheet(61)[0], sheet(31)[0]  # every other vertex
    source, target = (lifted(mesh) for mesh in plane)
    given = shaken(planar_correspondence(*plane), 0, 0.2)
    before = np.linalg.norm(places(given, source.vertices)[1] - target.vertices, axis=1)
    found = settled(given, source, target)
    after = np.linalg.norm(places(found, source.vertices)[1] - target.vertices, axis=1)
    assert before.mean() > 1e-3
    assert after.max() < 1e-9


def test_a_map_between_surfaces_apart_is_left_as_it_is() -> None:
    plane = sheet(61)[0], sheet(31)[0]
    source, target = (lifted(mesh) for mesh in plane)
    given = shaken(planar_correspondence(*plane), 1, 0.2)
    away = TriangleMesh(target.vertices + np.array([0, 0, 0.02]), target.faces)
    assert settled(given, source, away) is given
    # on the surface, and elsewhere than the map says: it has slid along itself
    slid = planar_correspondence(plane[0], TriangleMesh(plane[1].vertices * 0.9, plane[1].faces))
    assert settled(slid, source, target) is slid


def test_from_what_is_settled_it_spreads_over_what_the_map_has_wrong() -> None:
    """A patch that the map has elsewhere, and beneath it, nearer to some of it by chance, a second layer."""
    plane = sheet(61)[0], sheet(31)[0]
    source, target = (lifted(mesh) for mesh in plane)
    count = len(source.vertices)
    layers = TriangleMesh(
        np.concatenate([source.vertices, source.vertices - [0, 0, 0.002]]),
        np.concatenate([source.faces, source.faces[:, ::-1] + count]),
    )
    given = planar_correspondence(*plane)
    wrong = np.hypot(*(target.vertices[:, :2] - [0.3, 0.2]).T) < 0.2
    assert 0.01 < wrong.mean() < 0.05
    elsewhere = planar_correspondence(plane[0], TriangleMesh(plane[1].vertices * 0.5, plane[1].faces))
    given = replace(
        given,
        face=np.where(wrong, elsewhere.face, given.face),
        barycentric=np.where(wrong[:, None], elsewhere.barycentric, given.barycentric),
        source_triangles=layers.faces,
        source_size=len(layers.vertices),
    )
    found = settled(given, layers, target)
    assert np.linalg.norm(places(found, layers.vertices)[1] - target.vertices, axis=1).max() < 1e-9
    assert (found.face < len(source.faces)).all()
