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
