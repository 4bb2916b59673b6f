from dataclasses import replace

import numpy as np
import pytest
from scans import bumps
from surfaces import planar, rectangle, rings

from solver import Mobius, TriangleMesh, flatten
from solver.align.maps.refine import _stages, refined
from solver.surface.descriptors import diffused_curvatures
from solver.surface.statistics import standardised


@pytest.fixture(scope="module")
def sheet():
    mesh = bumps(1200, seed=3)
    return flatten(mesh), standardised(diffused_curvatures(mesh), mesh.vertex_areas)


def farthest(a: Mobius, b: Mobius) -> float:
    """Largest distance between the images of the middle of the disc."""
    x = 0.8 * rings(6)
    return float(np.abs(a(x) - b(x)).max())


@pytest.mark.parametrize(("z", "theta"), [(0.05, 0.0), (-0.03 + 0.04j, 0.08), (0.02j, -0.1)])
def test_a_small_error_is_undone(sheet, z, theta):
    flattening, descriptors = sheet
    found = refined(Mobius(z, theta), flattening, flattening, descriptors, descriptors, 0.7)
    assert farthest(found, Mobius()) < 1e-3


def test_a_known_transformation_is_recovered_from_its_neighbourhood(sheet):
    """The target's disc moved by a transformation: what is found is that one, also reflected."""
    flattening, descriptors = sheet
    for truth in (Mobius(0.3 - 0.2j, 1.0), Mobius(0.3 - 0.2j, 1.0, True)):
        disc, mesh = truth(flattening.disc), flattening.mesh
        if truth.reflected:
            mesh = replace(mesh, faces=mesh.faces[:, ::-1])
        moved = replace(flattening, mesh=mesh, disc=disc)
        found = refined(Mobius(0.03, 0.05) @ truth, flattening, moved, descriptors, descriptors, 0.7)
        assert found.reflected == truth.reflected
        assert farthest(found, truth) < 2e-3


def test_it_never_gets_worse(sheet):
    """From far away it may stay in a wrong maximum, but the agreement does not fall."""
    flattening, descriptors = sheet
    start = Mobius(0.1, 2.0)
    found = refined(start, flattening, flattening, descriptors, descriptors, 0.7)

    def agreement(mobius):
        near = np.abs(mobius(flattening.disc)[:, None] - flattening.disc).argmin(axis=1)
        square = ((descriptors - descriptors[near]) ** 2).sum(axis=1)
        return flattening.mesh.vertex_areas @ np.exp(-square / (2 * 0.7**2))

    assert agreement(found) > 0.98 * agreement(start)


def test_without_relief_it_stays_where_it_is():
    flattening = flatten(planar(rings(8)))
    flat = np.zeros((len(flattening.disc), 4))
    start = Mobius(0.2, 0.3)
    assert refined(start, flattening, flattening, flat, flat, 0.7) == start


def test_what_lies_near_the_rim_comes_later():
    depth = np.array([0.0, 1e-5, 1e-3, 0.1, 0.5])
    assert [list(seen) for seen in _stages(depth, np.array([0.5, 0.0, 0.0, 0.25, 0.25]))] == [[0, 1, 2, 3, 4]]
    stages = _stages(depth, np.full(5, 0.2))
    assert [list(seen) for seen in (stages[0], stages[1], stages[-2], stages[-1])] == [
        [3, 4],
        [2, 3, 4],
        [2, 3, 4],
        [0, 1, 2, 3, 4],
    ]
    assert len(stages) < 8


def test_a_band_is_refined_to_its_ends():
    """Half of a band eight times as long as wide lies within 1/300 of the rim; a theta 0.002 off is far off there."""
    points = rectangle(120, 1 / 8)
    rng = np.random.default_rng(2)
    height = sum(
        0.02 * np.exp(-(np.abs(points - complex(x, y)) ** 2) / (2 * 0.03**2))
        for x, y in zip(rng.uniform(-1, 1, 60), rng.uniform(-1 / 8, 1 / 8, 60), strict=True)
    )
    flat = planar(points)
    band = TriangleMesh(np.column_stack([points.real, points.imag, height]), flat.faces, "band")
    disc, descriptors = flatten(band), standardised(diffused_curvatures(band), band.vertex_areas)
    found = refined(Mobius(0.002, 0.002), disc, disc, descriptors, descriptors, 0.7)
    assert abs(found.z) < 1e-6
    assert abs(found.theta) < 1e-6
