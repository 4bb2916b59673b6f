"""The same input gives the same bits, and the last digits of the coordinates decide nothing."""

import numpy as np
import pytest
from scans import bumps, posed, remeshed
from stability import SAME, apart, places

from solver import AlignSettings, TriangleMesh

REAL = {
    "faces": ("faces_simpop/SIMPOP_01.obj", "faces_simpop/SIMPOP_10.obj"),
    "teeth": ("teeth/i14.obj", "teeth/i15.obj"),
    "feet": ("bodyparts/foot_4_a.obj", "bodyparts/foot_4_b.obj"),
    "ears": ("bodyparts/ear_7_a.obj", "bodyparts/ear_7_b.obj"),
}


@pytest.mark.parametrize("kind", REAL)
def test_the_last_digits_decide_nothing(real_mesh, kind):
    source, target = (real_mesh(file) for file in REAL[kind])
    moved = apart(source, target)
    assert moved.mean() < SAME
    assert np.quantile(moved, 0.99) < SAME


def test_the_same_input_gives_the_same_bits():
    """Whatever lies beside it in memory."""
    source = bumps(900, seed=2)
    target, _ = remeshed(posed(source, 1), 0.6, 2)
    settings = AlignSettings(samples=60, targets=400)
    first = places(source, target, settings)
    for count in (1, 3, 8):
        padded = [np.zeros(count), TriangleMesh(source.vertices.copy(), source.faces.copy())]
        assert np.array_equal(places(padded[1], target, settings), first)
