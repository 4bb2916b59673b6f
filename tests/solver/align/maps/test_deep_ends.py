"""The end of a long tube: a point of its disc, brought to that of another."""

from dataclasses import replace

import numpy as np
import pytest
from garments import tube_form, woven

from solver import Flattening, Mobius, flatten
from solver.align.maps.deep_ends import end_to_end


@pytest.fixture(scope="module")
def sleeve() -> tuple[Flattening, np.ndarray]:
    """The disc of a sleeve of 16 radii, and how far along it each vertex is, in [0, 1]."""
    mesh, place = woven(tube_form(16), 96, 16, 0.0, 1, tube=True)
    return flatten(mesh, fill_holes=True), place[:, 1]


def radii_off(found: Mobius, truth: Mobius, flattening: Flattening, along: np.ndarray) -> np.ndarray:
    """How far vertices are moved beside their place, in their distance from the end, about a radius of the tube."""
    place = truth(flattening.disc)
    end = place[along > 0.99].mean()
    return np.abs(found(flattening.disc) - place) / np.abs(place - end)


@pytest.mark.parametrize("truth", [Mobius(), Mobius(0.3 - 0.2j, 1.0), Mobius(0.3 - 0.2j, 1.0, True)])
def test_a_small_error_does_not_grow_along_the_tube(sleeve: tuple[Flattening, np.ndarray], truth: Mobius) -> None:
    flattening, along = sleeve
    mesh = flattening.mesh
    if truth.reflected:
        mesh = replace(mesh, faces=mesh.faces[:, ::-1])
    moved = replace(flattening, mesh=mesh, disc=truth(flattening.disc))
    near = Mobius(1e-3 - 2e-3j, 2e-3) @ truth
    found = end_to_end(near, flattening, moved)
    assert found is not None
    deep = (along > 0.5) & (along < 0.95)
    assert np.median(radii_off(near, truth, flattening, along)[deep]) > 10
    assert np.median(radii_off(found, truth, flattening, along)[deep]) < 0.02


def test_ends_that_lie_apart_stay_so(sleeve: tuple[Flattening, np.ndarray]) -> None:
    flattening, _ = sleeve
    assert end_to_end(Mobius(0.5j), flattening, flattening) is None
