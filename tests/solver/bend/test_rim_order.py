"""Boundary vertices in order by distances on the surface, against all orders there are."""

from itertools import product

import numpy as np
import pytest

from solver.bend.rim import Rim, surest


def _cut(angle: np.ndarray, where: float) -> np.ndarray:
    return (angle - where) % (2 * np.pi)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("way", [1, -1])
def test_no_other_order_is_nearer(seed: int, way: int):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(-3, 3, 9))
    rim = Rim(np.exp(1j * way * angle), rng.normal(size=(9, 3)))
    conformal = np.exp(1j * way * np.linspace(-2.5, 2.5, 4))
    carried = np.exp(-0.1 + 1j * way * rng.uniform(-2.5, 2.5, 4))
    bent, offset = rng.normal(size=(4, 3)), np.full(4, 0.5)
    found = rim.ordered(carried, conformal, bent, offset)

    if (way * np.angle(np.roll(carried, -1) / carried) > 0).all():
        assert found == pytest.approx(carried)
        return
    first = surest(carried, conformal)
    order = np.roll(np.arange(4), -first)
    where = way * np.angle(carried[first])

    def total(places: np.ndarray) -> float:
        own = places == carried
        near = np.array(
            [
                np.linalg.norm(rim.position[np.argmin(np.abs(rim.disc - z))] - x)
                for z, x in zip(places, bent, strict=True)
            ]
        )
        return float(np.where(own, offset, near).sum())

    least = min(
        total(np.array(places))
        for places in product(*([one, *rim.disc] for one in carried))
        if (np.diff(_cut(way * np.angle(np.array(places)[order]), where)) > 0).all()
    )
    assert (np.diff(_cut(way * np.angle(found[order]), where)) > 0).all()
    assert total(found) == pytest.approx(least)


def test_jags_that_are_mixed_up_go_where_they_are_near():
    """The tips of a star, two of them caught on the next tip: in angles right ones would move as well."""
    tip = np.exp(2j * np.pi * np.arange(8) / 8)
    position = np.stack([tip.real, tip.imag, np.zeros(8)], axis=1)
    rim = Rim(tip, position)
    carried = tip * np.exp(0.01j)
    carried[2], carried[5] = tip[3] * np.exp(0.02j), tip[4] * np.exp(-0.02j)
    offset = np.full(8, 1e-3)
    offset[[2, 5]] = 0.5
    found = rim.ordered(carried, tip, position, offset)
    # each at its own tip again, the others hardly moved
    assert np.abs(found - tip).max() < 0.02
