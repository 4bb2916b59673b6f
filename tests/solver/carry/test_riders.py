"""Parts that ride along: teeth go with a jaw, eyeballs turn about their centres, lashes turn with the lash below."""

from dataclasses import replace

import numpy as np
import pytest
from assembled import assembled, ball, card
from scans import bumps, similarity
from scipy.spatial.transform import Rotation

from solver import AlignSettings, Correspondence, TriangleMesh, align, correspond
from solver.carry.gradients import GradientTransfer
from solver.carry.riders import Riders

SCALE, TURN, SHIFT = similarity(np.random.default_rng(5))
SKIN, OTHER_SKIN = bumps(1500, 3), bumps(1100, 3)
SETTINGS = AlignSettings(samples=60, targets=400, reflect="never")


def aligned(
    source: list[TriangleMesh], target: list[TriangleMesh]
) -> tuple[TriangleMesh, TriangleMesh, Correspondence]:
    """Skins with things beside them, the target in another pose, and the map."""
    one, other = assembled(SKIN, *source), assembled(OTHER_SKIN, *target)
    other = TriangleMesh(SCALE * other.vertices @ TURN + SHIFT, other.faces)
    return one, other, correspond(align(one, other, SETTINGS))


def carried(source: list[TriangleMesh], target: list[TriangleMesh], moved: list[np.ndarray]) -> list[np.ndarray]:
    """Displacements that each thing of the target gets, as it was before it was posed, for those of the source."""
    one, other, found = aligned(source, target)
    result = GradientTransfer.of(found, one, other)(np.concatenate([np.zeros_like(SKIN.vertices), *moved]))
    ends = np.cumsum([len(OTHER_SKIN.vertices), *(len(thing.vertices) for thing in target)])
    return np.split(result @ TURN.T / SCALE, ends)[1:-1]


def turned(mesh: TriangleMesh, axis: str, degrees: float, about: tuple[float, float, float]) -> np.ndarray:
    """The displacement of a rotation."""
    turn, middle = Rotation.from_euler(axis, degrees, degrees=True), np.array(about)
    return turn.apply(mesh.vertices - middle) + middle - mesh.vertices


def bar(z: float) -> TriangleMesh:
    """A row of teeth in one piece."""
    one = ball((0, 0, 0), 1.0, rings=10)
    return TriangleMesh(one.vertices * [0.55, 0.05, 0.03] + [0.0, -0.35, z], one.faces)


def row(z: float) -> list[TriangleMesh]:
    one = ball((0, 0, 0), 1.0, rings=4)
    at = [np.array([0.09 * (k - 5.5), -0.35, z]) for k in range(12)]
    return [TriangleMesh(one.vertices * [0.04, 0.04, 0.025] + place, one.faces) for place in at]


def test_teeth_without_counterparts_go_with_the_row_that_they_are_pieces_of() -> None:
    hinge = (0.0, 0.5, 0.1)
    upper, lower = bar(0.35), bar(0.12)
    things = [*row(0.35), *row(0.12)]
    got = carried([upper, lower], things, [np.zeros_like(upper.vertices), turned(lower, "x", 25, hinge)])
    for thing, values in zip(things[:12], got[:12], strict=True):
        assert np.linalg.norm(values, axis=1).max() < 0.005, thing.vertices.mean(axis=0)
    for thing, values in zip(things[12:], got[12:], strict=True):
        wanted = turned(thing, "x", 25, hinge)
        assert np.linalg.norm(values - wanted) < 0.1 * np.linalg.norm(wanted)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_an_eye_within_an_eye_turns_about_its_centre(axis: str) -> None:
    at = (0.35, 0.4, 0.1)
    # the lid is nearer to the eye than its shells are to each other
    eye, inner = ball(at, 0.16), ball(at, 0.1, rings=7)
    got = carried([eye], [eye, inner], [turned(eye, axis, 20, at)])
    for thing, values in zip((eye, inner), got, strict=True):
        wanted = turned(thing, axis, 20, at)
        assert np.linalg.norm(values - wanted) < 0.1 * np.linalg.norm(wanted)
        assert np.linalg.norm(values.mean(axis=0)) < 0.02 * 0.16


def test_layers_of_a_lash_without_counterparts_turn_with_the_one_that_has_one() -> None:
    lash = card((0.2, 0.5, 0.3), (0.2, 0.08))
    layers = [TriangleMesh(lash.vertices + np.array([0, 0.004 * k, 0]), lash.faces) for k in range(3)]
    got = carried([lash], layers, [turned(lash, "x", 60, (0.2, 0.5, 0.26))])
    for thing, values in zip(layers, got, strict=True):
        wanted = turned(thing, "x", 60, (0.2, 0.5, 0.26))
        assert np.linalg.norm(values - wanted) < 0.1 * np.linalg.norm(wanted)


def test_a_part_that_is_inside_out_beside_its_counterpart_is_moved_the_same_way() -> None:
    lash = card((0.2, 0.5, 0.3), (0.2, 0.08))
    other = TriangleMesh(lash.vertices, lash.faces[:, ::-1])
    moved = turned(lash, "x", 60, (0.2, 0.5, 0.26))
    for target in (lash, other):
        (got,) = carried([lash], [target], [moved])
        assert np.linalg.norm(got - moved) < 0.1 * np.linalg.norm(moved)


def test_where_nothing_rides_there_is_nothing() -> None:
    lash = card((0.2, 0.5, 0.3), (0.2, 0.08))
    one, other, found = aligned([lash], [lash])
    transfer = GradientTransfer.of(found, one, other)
    assert transfer.riders is None
    assert Riders.of(replace(found, leader=None), one, other, transfer.rotation, transfer.scale) is None
