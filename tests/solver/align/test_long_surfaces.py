"""Surfaces that a disc holds badly: a right map, or a refusal with the reason."""

import numpy as np
import pytest

from solver import AlignSettings, MeshError, TriangleMesh, align, correspond, flatten, verdict
from solver.align.cut.held import held


def belt(length: int, rows: int) -> TriangleMesh:
    """A wavy band, so many times as long as wide."""
    columns = (rows - 1) * length + 1
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, length, columns), np.linspace(0, 1, rows)))
    i, j = (a.ravel() for a in np.mgrid[: rows - 1, : columns - 1])
    a, b, c, d = i * columns + j, i * columns + j + 1, (i + 1) * columns + j + 1, (i + 1) * columns + j
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return TriangleMesh(np.stack([x, y, 0.1 * np.sin(2 * x) + 0.1 * np.cos(1.3 * x + 3 * y)], axis=1), faces, "Belt")


def tube(length: int, around: int = 12, skirt: int = 8) -> TriangleMesh:
    """A closed tube, `length` / 2 radii long, on a flat ring."""
    turn = np.exp(2j * np.pi * np.arange(around) / around)
    steps = np.arange(skirt + length)
    radius = np.where(steps < skirt, 1 + (skirt - steps) / 2, 1.0)
    height = np.maximum(steps - skirt, 0) / 2
    places = radius[:, None] * turn
    ring = np.stack([places.real, places.imag, np.broadcast_to(height[:, None], places.shape)], axis=2).reshape(-1, 3)
    i, k = (a.ravel() for a in np.mgrid[: len(steps) - 1, :around])
    a, b = i * around + k, i * around + (k + 1) % around
    top, last = len(ring), len(ring) - around + np.arange(around)
    faces = [
        np.stack([a, b, b + around], axis=1),
        np.stack([a, b + around, a + around], axis=1),
        np.stack([last, np.roll(last, -1), np.full(around, top)], axis=1),
    ]
    return TriangleMesh(np.concatenate([ring, [[0, 0, (length + 1) / 2]]]), np.concatenate(faces), "Tube")


def test_a_band_of_one_to_ten_is_aligned_right_and_said_to_be_narrow() -> None:
    source, target = belt(10, 7), belt(10, 6)
    alignment = align(source, target, AlignSettings(samples=60, targets=400, reflect="never"))
    places = correspond(alignment).matrix() @ source.vertices
    assert 100 * np.linalg.norm(places - target.vertices, axis=1).mean() / source.diagonal < 0.3
    assert any("'Belt' is long and narrow" in said for said in alignment.warnings)


@pytest.mark.parametrize("length", [16, 20, 100, 200])
def test_longer_bands_are_refused(length: int) -> None:
    with pytest.raises(MeshError, match=r"^'Belt' is too long and narrow to be aligned in a disc"):
        align(belt(length, 5), belt(length, 4), AlignSettings(samples=40, targets=200))


@pytest.mark.parametrize(("method", "length"), [("harmonic", 150), ("harmonic", 400), ("mid-edge", 80)])
def test_deep_tubes_are_refused_with_their_ratio(method: str, length: int) -> None:
    with pytest.raises(MeshError, match=r"^'Tube' is too deep or too long for a disc: .* 1/10\^\d+ of their area"):
        flatten(tube(length), method)


@pytest.mark.parametrize(("method", "length"), [("harmonic", 60), ("harmonic", 100), ("mid-edge", 40)])
def test_shorter_tubes_are_injective(method: str, length: int) -> None:
    found = flatten(tube(length), method)
    assert found.distortion.flips == 0
    assert np.abs(found.disc).max() <= 1 + 1e-12


def test_too_few_vertices_inside_are_refused_by_name() -> None:
    one = TriangleMesh(np.eye(3), [[0, 1, 2]], "One")
    for source, target in ((one, belt(4, 5)), (belt(4, 5), one), (belt(8, 2), belt(8, 2))):
        with pytest.raises(MeshError, match=r"^'(One|Belt)' has 0 vertices inside its boundary"):
            align(source, target)
    with pytest.raises(MeshError, match=r"^'One' has 0 vertices inside its boundary"):
        held(verdict(one).tidy)


@pytest.mark.parametrize(
    ("mesh", "kind"), [(belt(8, 7), None), (belt(12, 7), "narrow"), (tube(6), None), (tube(60), "deep")]
)
def test_what_a_disc_holds_badly_is_known_before(mesh: TriangleMesh, kind: str | None) -> None:
    found = held(verdict(mesh).tidy)
    assert (found.kind if found else None) == kind


@pytest.mark.parametrize("mesh", [belt(14, 7), belt(200, 4), tube(150), tube(400)])
def test_what_no_disc_holds_is_refused_before(mesh: TriangleMesh) -> None:
    tidy = verdict(mesh).tidy
    with pytest.raises(MeshError, match=r"too (long and narrow to be aligned in|deep or too long for) a disc.*: cut"):
        held(tidy)
