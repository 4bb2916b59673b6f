from dataclasses import replace

import numpy as np
import pytest
from scans import bumps
from surfaces import planar, rings

from solver import Mobius, flatten
from solver.descriptors import diffused_curvatures, standardised
from solver.refine import refined


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
