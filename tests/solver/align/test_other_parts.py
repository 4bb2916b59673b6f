"""Parts beside the main one: which is which, where they are many, equal, missing, mirrored, tiny or touching."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from assembled import assembled, ball, card
from scans import bumps, mirrored, similarity
from surfaces import spherical_cap

from solver import AlignSettings, Cleaned, TriangleMesh, align, correspond
from solver.align.parts.completing import completed
from solver.align.result.alignment import Alignment
from solver.align.result.whole import Whole
from solver.surface.parts import Parts

SCALE, TURN, SHIFT = similarity(np.random.default_rng(5))


def posed(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(SCALE * mesh.vertices @ TURN + SHIFT, mesh.faces, mesh.name)


SKIN, OTHER_SKIN = bumps(1500, 3), bumps(1100, 3)


@cache
def skins(*, mirror: bool = False) -> Alignment:
    """The skins alone, aligned; the target in another pose, and mirrored or not."""
    target = posed(mirrored(OTHER_SKIN) if mirror else OTHER_SKIN)
    settings = AlignSettings(samples=60, targets=400, reflect="always" if mirror else "never")
    return align(SKIN, target, settings)


def whole(source: list[TriangleMesh], target: list[TriangleMesh], *, mirror: bool = False) -> Whole:
    """The other parts of two meshes whose main parts are the skins; `target` as it is before it is posed."""
    found = skins(mirror=mirror)
    one, other = assembled(SKIN, *source), assembled(OTHER_SKIN, *target)
    other = posed(mirrored(other) if mirror else other)
    tidy = [Cleaned.unchanged(skin) for skin in (found.source.mesh, found.target.mesh)]
    done = completed(found, *(Parts.of(mesh, main) for mesh, main in zip((one, other), tidy, strict=True)))
    assert done is not None
    return done


def paired(done: Whole, source: list[TriangleMesh], target: list[TriangleMesh]) -> dict[int, int | None]:
    """The place in `source` of the counterpart of each thing in `target`; None: it has none."""
    starts = [np.cumsum([len(skin.vertices), *(len(x.vertices) for x in things)]) for skin, things in
              ((SKIN, source), (OTHER_SKIN, target))]  # fmt: skip

    def place(parts: Parts, number: int, start: np.ndarray) -> int:
        vertex = int(np.flatnonzero(parts.of_vertex == number)[0])
        return int(np.searchsorted(start, vertex, side="right")) - 1

    return {
        place(done.target, pair.target, starts[1]): None
        if pair.source is None
        else place(done.source, pair.source, starts[0])
        for pair in done.pairs
        if pair.target
    }


def places(done: Whole) -> np.ndarray:
    """Where the vertices of the target's other parts belong on the source, (n, 3)."""
    source = done.source.mesh
    return np.einsum("qk,qkd->qd", done.barycentric, source.vertices[source.faces[done.face]])


def eyes(size: float = 0.12) -> list[TriangleMesh]:
    return [ball((-0.35, 0.4, 0.1), size), ball((0.35, 0.4, 0.1), size)]


def teeth(count: int = 12) -> list[TriangleMesh]:
    """Equal ones in a row, with little gaps."""
    return [ball((0.09 * (k - (count - 1) / 2), -0.35, 0.12), 0.04, rings=4) for k in range(count)]


def test_every_part_finds_its_own() -> None:
    things = [*eyes(), *teeth(), card((0.0, 0.7, 0.2), (0.3, 0.1))]
    others = [*eyes(), *teeth(), card((0.0, 0.7, 0.2), (0.3, 0.1), cells=3)]
    order = np.random.default_rng(0).permutation(len(others))
    done = whole(things, [others[k] for k in order])
    assert paired(done, things, [others[k] for k in order]) == dict(enumerate(order))
    assert (done.confidence[done.face >= 0] > 0.5).mean() > 0.9


def test_left_stays_left_and_mirrored_goes_to_the_other_side() -> None:
    for mirror in (False, True):
        done = whole(eyes(), eyes(), mirror=mirror)
        # the target's vertices keep their order when it is mirrored: its first eye is the image of the source's first
        assert paired(done, eyes(), eyes()) == {0: 0, 1: 1}, mirror


@pytest.mark.parametrize("gone", [0, 5, 11])
def test_a_tooth_that_is_gone_moves_no_other(gone: int) -> None:
    fewer = [x for k, x in enumerate(teeth()) if k != gone]
    left = [k for k in range(12) if k != gone]
    assert paired(whole(teeth(), fewer), teeth(), fewer) == dict(enumerate(left))
    back = paired(whole(fewer, teeth()), fewer, teeth())
    assert back == {k: None if k == gone else left.index(k) for k in range(12)}


def test_neighbours_of_which_each_side_lacks_one_are_not_paired() -> None:
    here, there = [[x for k, x in enumerate(teeth()) if k != gone] for gone in (5, 6)]
    found = paired(whole(here, there), here, there)
    assert found[5] is None, "the target's sixth, where the source has none"
    assert sum(x is None for x in found.values()) == 1


def test_layers_of_a_lash_keep_their_order() -> None:
    layers = [card((0.2, 0.5 + 0.004 * k, 0.2), (0.25, 0.08)) for k in range(4)]
    other = [card((0.2, 0.5 + 0.004 * k, 0.2), (0.25, 0.08), cells=5) for k in range(4)]
    assert paired(whole(layers, other[::-1]), layers, other[::-1]) == {k: 3 - k for k in range(4)}


def test_three_hundred_cards_of_hair() -> None:
    rng = np.random.default_rng(1)
    at = np.array([(x, y) for x in np.linspace(-0.6, 0.6, 20) for y in np.linspace(-0.6, 0.6, 15)])
    at = at + rng.uniform(-0.01, 0.01, at.shape)
    turn = rng.uniform(0, 2 * np.pi, len(at))
    hair, other = (
        [card((x, y, 0.25), (0.05, 0.1), a, cells) for (x, y), a in zip(at, turn, strict=True)] for cells in (2, 3)
    )
    found = paired(whole(hair, other), hair, other)
    assert np.mean([found[k] == k for k in range(len(hair))]) > 0.98


def test_what_has_no_counterpart_rides_with_what_is_next_to_it() -> None:
    mole = ball((0.1, 0.0, 0.3), 0.02, rings=4)
    done = whole(eyes(), [*eyes(), mole])
    assert paired(done, eyes(), [*eyes(), mole])[2] is None
    riders = np.flatnonzero(done.leader >= 0)
    assert len(riders) == len(mole.vertices)
    assert (done.confidence[riders] == 0).all()
    # as one piece: on one point of the skin below it, where that point belongs
    assert len(np.unique(done.face[riders])) == 1
    assert np.linalg.norm(places(done)[riders[0], :2] - [0.1, 0.0]) < 0.05


def test_a_source_without_parts_and_a_target_without() -> None:
    done = whole([], eyes())
    assert {x.target for x in done.pairs if x.source is None} == {1, 2}
    assert done.leader[-1] >= 0
    assert (done.face[done.leader >= 0] >= 0).all()
    done = whole(eyes(), [])
    assert done.counts() == (1, 0, 2)
    assert (done.face == -1).all()


def test_debris_of_one_triangle_and_less_breaks_nothing() -> None:
    crumbs = [TriangleMesh([[x, 0, 0.5], [x + 1e-3, 0, 0.5], [x, 1e-3, 0.5]], [[0, 1, 2]]) for x in (-0.3, 0.0, 0.2)]
    crumbs.append(TriangleMesh([[0, 0, 0.6], [1e-9, 0, 0.6], [0, 1e-9, 0.6]], [[0, 1, 2]]))
    crumbs.append(TriangleMesh([[0.3, 0.3, 0.6]] * 3, [[0, 1, 2]]))
    line = TriangleMesh([[0, 0.5, 0.5], [0.1, 0.5, 0.5], [0.2, 0.5, 0.5]], [[0, 1, 2]])
    here, there = [*eyes(), *crumbs, line], [*crumbs, *eyes(), line]
    found = paired(whole(here, there), here, there)
    assert [found[k] for k in (5, 6)] == [0, 1]


def test_shells_that_lie_in_each_other_are_paired_one_to_one() -> None:
    shells = [*eyes(), *eyes()]
    found = paired(whole(shells, shells), shells, shells)
    assert sorted(found.values()) == [0, 1, 2, 3]
    assert {found[0], found[2]} == {0, 2}


def test_a_part_that_is_turned_inside_out_still_fits() -> None:
    inside_out = [TriangleMesh(x.vertices, x.faces[:, ::-1]) for x in eyes()]
    done = whole([card((0.2, 0.5, 0.2), (0.25, 0.1))], [*inside_out, card((0.2, 0.5, 0.2), (0.25, 0.1))])
    flipped = card((0.2, 0.5, 0.2), (0.25, 0.1))
    flipped = TriangleMesh(flipped.vertices, flipped.faces[:, ::-1])
    other = whole([card((0.2, 0.5, 0.2), (0.25, 0.1))], [*inside_out, flipped])
    size = len(card((0, 0, 0), (1, 1)).vertices)
    assert done.face[-1] >= 0
    for found in (done, other):
        assert np.abs(places(found)[-size:] - flipped.vertices).max() < 0.02


def test_points_of_parts_are_where_they_belong() -> None:
    done = whole(eyes(), [ball((-0.35, 0.4, 0.1), 0.12, 8), ball((0.35, 0.4, 0.1), 0.12, 8)])
    there = places(done)
    own = np.flatnonzero(done.face >= 0)
    before = (done.target.mesh.vertices - SHIFT) @ TURN.T / SCALE
    assert np.linalg.norm(there[own] - before[own], axis=1).mean() < 0.05 * 0.12 * 2


def test_the_whole_way_with_no_setting() -> None:
    source = assembled(SKIN, *eyes(), name="source")
    order = np.random.default_rng(0).permutation(2)
    target = posed(assembled(*[eyes()[k] for k in order], OTHER_SKIN, name="target"))
    settings = AlignSettings(samples=60, targets=400, reflect="never")
    found = align(source, target, settings)
    correspondence = correspond(found)
    assert found.whole is not None
    assert correspondence.source_part is not None
    assert found.whole.counts() == (3, 0, 0)
    assert not any("left out" in said for said in found.warnings)
    corner = correspondence.source_triangles[correspondence.face]
    assert (correspondence.source_part[corner] == correspondence.source_part[corner[:, :1]]).all()
    first = len(eyes()[0].vertices)
    from_eye = correspondence.source_part[corner[:, 0]]
    assert len(np.unique(from_eye[:first])) == 1
    assert from_eye[0] != from_eye[first]
    x = (correspondence.matrix() @ source.vertices)[:, 0]
    assert np.sign(x[[0, first]]).tolist() == [(-1, 1)[k] for k in order]

    alone = correspond(align(source, target, replace(settings, parts="main")))
    assert alone.part is None
    assert (alone.face[: 2 * first] == -1).all()
    skin = slice(2 * first, None)
    assert (alone.face[skin] == correspondence.face[skin]).all()
    assert (alone.barycentric[skin] == correspondence.barycentric[skin]).all()


def test_a_part_that_is_larger_than_the_skin_is_not_taken_for_it() -> None:
    cape = spherical_cap(10, 1.4)[0]
    cape = TriangleMesh(1.5 * cape.vertices - [0, 0, 2], cape.faces)
    assert SKIN.area / 4 < cape.area
    source = assembled(cape, SKIN, *eyes())
    target = posed(assembled(OTHER_SKIN, *eyes()[::-1]))
    found = align(source, target, AlignSettings(samples=60, targets=400, reflect="never"))
    assert any("largest parts" in said for said in found.warnings)
    assert found.whole is not None
    assert found.whole.counts() == (3, 0, 1)
    there = correspond(found)
    reached = there.matrix() @ source.vertices
    before = (target.vertices - SHIFT) @ TURN.T / SCALE
    assert np.median(np.linalg.norm(reached - before, axis=1)) < 0.02


def test_a_closed_part_that_is_larger_than_the_skin() -> None:
    shell = ball((0, 0, -1), 0.8, rings=12)
    found = align(
        assembled(shell, SKIN, *eyes()),
        posed(assembled(OTHER_SKIN, *eyes(), shell)),
        AlignSettings(samples=60, targets=400, reflect="never"),
    )
    assert found.whole is not None
    assert found.whole.counts() == (4, 0, 0)
