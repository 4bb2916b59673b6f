from dataclasses import replace

import numpy as np
import pytest
from bodies import revolved
from garments import woven
from scans import bumps

from solver import AlignSettings, TriangleMesh, align
from solver.align.doubt.own_motion import motions, with_motions_open
from solver.align.surfaces.remark import Remark

SETTINGS = AlignSettings(samples=40, targets=200, refine="mobius", reflect="never")
PARTIAL = Remark("partial", "partial overlap: 30 % of the target without a counterpart on the other surface")


def sheet(around: int, seed: int) -> TriangleMesh:
    """A round sheet with hills that are the same after so many turns about its middle."""
    x, y = bumps(700, seed=seed).vertices[:, :2].T
    rng, height = np.random.default_rng(5), np.zeros(len(x))
    for _ in range(6):
        radius, angle, size, width = rng.uniform((0.2, 0, -0.2, 6), (0.8, 2 * np.pi, 0.2, 20))
        for turn in angle + 2 * np.pi * np.arange(around) / around:
            height += size * np.exp(-width * ((x - radius * np.cos(turn)) ** 2 + (y - radius * np.sin(turn)) ** 2))
    return TriangleMesh(np.column_stack([x, y, height]), bumps(700, seed=seed).faces)


@pytest.mark.parametrize("around", [3, 1])
def test_where_a_sheet_is_alike_a_part_of_it_may_lie_elsewhere(around: int) -> None:
    """Turned about the middle by a share of a full turn, each as far as that is; what is not alike is not doubted."""
    one, other = sheet(around, 1), sheet(around, 2)
    found = align(one, other, SETTINGS)
    whole = with_motions_open(replace(found, remarks=())).remarks
    assert [one.kind for one in whole] == ["rival"] * (around > 1)  # of which the search says it, too
    part = replace(found, counterpart=other.vertices[:, 0] > -0.3)
    said = with_motions_open(part.annotated(remarks=(PARTIAL,))).remarks
    assert any(one.kind == "rival" for one in said) == (around > 1)
    if around > 1:
        radius = np.sqrt((one.vertices[:, :2] ** 2).sum(axis=1)).mean()
        turned = 2 * np.sin(np.pi / around) * radius / one.diagonal
        assert any(abs(motion.moved - turned) < 0.05 for motion in motions(part))


def cut(mesh: TriangleMesh, angle: float, beyond: float) -> TriangleMesh:
    """What of a sheet lies on one side of a line."""
    inside = mesh.vertices[:, 0] * np.cos(angle) + mesh.vertices[:, 1] * np.sin(angle) > beyond
    faces = mesh.faces[inside[mesh.faces].all(axis=1)]
    used = np.unique(faces)
    return TriangleMesh(mesh.vertices[used], np.searchsorted(used, faces))


@pytest.mark.parametrize("beyond", [-0.3, 0.0])
@pytest.mark.parametrize("around", [3, 1])
def test_pieces_that_are_cut_alike_may_be_others(around: int, beyond: float) -> None:
    """Of what has three like sides they fit each other wholly, though they share a third of the sheet, or more."""
    turn = 2 * np.pi / 3 if around == 3 else 0.0
    found = align(cut(sheet(around, 1), 0.4, beyond), cut(sheet(around, 2), 0.4 + turn, beyond), SETTINGS)
    assert found.mean_confidence > 0.5
    said = with_motions_open(found.annotated(remarks=())).remarks
    assert [one.kind for one in said] == ["rival"] * (around == 3)


@pytest.mark.parametrize("dent", [0.0, 0.3])
@pytest.mark.parametrize("closed", [False, True], ids=["tube", "vase"])
def test_a_tube_or_a_vase_may_be_turned_about_its_axis(closed: bool, dent: float) -> None:
    """Of which a disc has little room for the far end, so that a turn moves little there; a dent tells how it is."""

    def form(around: np.ndarray, along: np.ndarray, _: float) -> np.ndarray:
        turn = 2 * np.pi * around
        radius = (0.8 + 0.2 * along) * (np.sqrt(np.minimum(1, along / 0.3)) if closed else 1)
        away = ((around - 0.4) / 0.08) ** 2 + ((along - 0.6) / 0.15) ** 2
        radius = radius - dent * np.exp(-away)
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), 2.5 * along], axis=1)

    meshes = [woven(form, *size, 0.0, seed, tube=True)[0] for seed, size in enumerate([(24, 30), (22, 27)])]
    found = align(meshes[0], meshes[1], AlignSettings(samples=60, targets=300, reflect="never"))
    assert any(one.kind == "rival" for one in found.remarks) == (dent == 0)


def test_a_body_of_revolution_may_be_turned_any_way() -> None:
    """Of two, with other triangles, nothing tells how far they are turned about their axis."""
    bodies = []
    for rings, segments in ((24, 20), (20, 18)):
        turn = np.linspace(0, np.pi, rings)
        bodies.append(revolved(-2 * np.cos(turn), np.sin(turn) * (1 - 0.3 * np.cos(turn)), segments))
    found = align(bodies[0], bodies[1], replace(SETTINGS, most_nodes=2000))
    said = with_motions_open(found.annotated(remarks=())).remarks
    assert [one.kind for one in said] == ["rival"]
