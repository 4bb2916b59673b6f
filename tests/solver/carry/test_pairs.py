"""A finished map bent through pairs of points: what is known exactly on flat sheets, and who is outvoted."""

import numpy as np
import pytest
from correspondences import on_itself, sheet
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Correspondence, TriangleMesh
from solver.carry.pair_votes import BOUND, limits
from solver.carry.pairs import REACH, PointPairs, through_pairs

MESH = sheet(41)[0]


def identity(mesh: TriangleMesh, confidence: float) -> Correspondence:
    """Every vertex on itself."""
    size = len(mesh.vertices)
    found = on_itself(mesh, 0)
    face = np.where(mesh.used, found.face, -1)
    barycentric = np.where(mesh.used[:, None], found.barycentric, 0.0)
    return Correspondence(
        face, barycentric, np.full(size, confidence >= 0.5), np.full(size, confidence), mesh.faces, size
    )


def places(found: Correspondence, source: TriangleMesh) -> np.ndarray:
    """Where each target vertex goes, (n, 3)."""
    return found.matrix() @ source.vertices


def pairs(source: TriangleMesh, target: TriangleMesh, rows: list[tuple[tuple[float, float], tuple[float, float]]]):
    """Pairs (on the source, on the target) of points of flat sheets."""
    on = np.array(rows, float)
    flat = np.zeros((len(rows), 1))
    return PointPairs.near(source, target, np.hstack([on[:, 0], flat]), np.hstack([on[:, 1], flat]))


@pytest.mark.parametrize("move", [(0.05, 0.02), (0.3, -0.2), (-0.6, 0.1)])
def test_a_pair_bends_the_map_smoothly_and_not_far_away(move):
    target = (0.1, 0.05)
    goal = target[0] + move[0], target[1] + move[1]
    found = through_pairs(identity(MESH, 0.2), MESH, MESH, pairs(MESH, MESH, [(goal, target)]))
    length = np.hypot(*move)
    assert found.followed.all()
    assert found.missed[0] == pytest.approx(length / MESH.diagonal, rel=1e-6)
    assert found.left[0] < 1e-4
    now = places(found.correspondence, MESH)
    shift = np.linalg.norm(now - MESH.vertices, axis=1)
    reach = max(REACH * MESH.diagonal, 2 * length)
    # nothing moves that the reach does not touch on the way, and nothing farther than the pair
    way = np.array([target, goal])
    t = np.clip(((MESH.vertices[:, :2] - way[0]) @ np.array(move)) / length**2, 0, 1)
    apart = np.linalg.norm(MESH.vertices[:, :2] - way[0] - t[:, None] * np.array(move), axis=1)
    assert (shift[apart > 1.01 * reach] < 1e-12).all()
    assert shift.max() <= length * 1.01
    # no triangle is turned over, beyond those that were pushed flat against the edge of the sheet
    areas = TriangleMesh(now, MESH.faces).face_vectors[:, 2]
    assert areas.min() > -1e-9
    assert found.folded == 0


def test_a_pair_that_agrees_changes_nothing():
    found = through_pairs(identity(MESH, 0.9), MESH, MESH, pairs(MESH, MESH, [((0.3, 0.2), (0.3, 0.2))]))
    assert found.followed.all()
    assert not found.moved.any()


def test_no_pairs_change_nothing():
    given = identity(MESH, 0.9)
    found = through_pairs(given, MESH, MESH, pairs(MESH, MESH, [((0.3, 0.2), (0.3, 0.2))] * 0 or [((0, 0), (0, 0))]))
    assert (found.correspondence.barycentric == given.barycentric).all()
    none = PointPairs(*(np.empty(shape, kind) for shape, kind in ((0, np.intp), ((0, 3), float)) * 2))
    assert not through_pairs(given, MESH, MESH, none).moved.any()


@settings(max_examples=15, deadline=None)
@given(
    st.lists(
        st.tuples(*(st.floats(-0.7, 0.7) for _ in range(2)), *(st.floats(-0.05, 0.05) for _ in range(2))),
        min_size=1,
        max_size=6,
        unique_by=lambda row: (round(3 * row[0]), round(3 * row[1])),
    )
)
def test_several_pairs_are_met_together_without_a_fold(rows):
    given = [((x + u, y + v), (x, y)) for x, y, u, v in rows]
    found = through_pairs(identity(MESH, 0.1), MESH, MESH, pairs(MESH, MESH, given), follow_all=True)
    assert found.left.max() < 2e-4
    assert found.folded == 0


def test_a_pair_alone_is_outvoted_by_a_map_that_is_sure():
    near, far = 0.9 * BOUND * MESH.diagonal, 4 * BOUND * MESH.diagonal
    for move, followed in ((near, True), (far, False)):
        found = through_pairs(identity(MESH, 0.99), MESH, MESH, pairs(MESH, MESH, [((move, 0.0), (0.0, 0.0))]))
        assert found.followed.tolist() == [followed]
        assert found.moved.any() == followed
    rows = pairs(MESH, MESH, [((far, 0.0), (0.0, 0.0))])
    assert through_pairs(identity(MESH, 0.99), MESH, MESH, rows, follow_all=True).followed.all()
    assert through_pairs(identity(MESH, 0.3), MESH, MESH, rows).followed.all()


def test_pairs_that_agree_overrule_a_map_that_is_sure():
    far = 2.5 * BOUND * MESH.diagonal
    rows = [((x + far, y), (x, y)) for x, y in ((0.0, 0.0), (0.03, 0.0), (0.0, 0.03))]
    found = through_pairs(identity(MESH, 0.99), MESH, MESH, pairs(MESH, MESH, rows))
    assert found.followed.all()
    assert found.left.max() < 1e-3


def test_a_wrong_pair_is_outvoted_by_those_around_it():
    right = [((x + 0.1, y), (x, y)) for x, y in ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1), (0.1, 0.1))]
    wrong = ((-0.5, 0.3), (0.05, 0.05))
    found = through_pairs(identity(MESH, 0.3), MESH, MESH, pairs(MESH, MESH, [*right, wrong]))
    assert found.followed.tolist() == [True] * 4 + [False]
    assert found.left[:4].max() < 1e-3


def test_a_surer_map_is_moved_less_and_more_pairs_move_it_farther():
    sure = limits(np.array([0.0, 0.3, 0.6, 0.9, 0.99, 1.0]))
    assert (np.diff(sure) <= 0).all()
    assert sure[0] == np.inf
    assert sure[-1] == pytest.approx(BOUND)
    assert limits(np.array([0.9]), 3) == pytest.approx(3 * limits(np.array([0.9])))


def test_what_is_across_an_opening_does_not_go_along():
    """A sheet with a slit: what lies beyond it is near in space, and far on the surface."""
    x, y = MESH.vertices[MESH.faces].mean(axis=1)[:, :2].T
    slit = TriangleMesh(MESH.vertices, MESH.faces[~((np.abs(y) < 0.05) & (x > -0.7))])
    given = [((0.6, 0.25), (0.6, 0.15))]
    found = through_pairs(identity(slit, 0.1), slit, slit, pairs(slit, slit, given))
    assert found.left[0] < 1e-4
    moved = np.flatnonzero(found.moved & slit.used)
    beyond = (MESH.vertices[moved, 1] < -0.02) & (MESH.vertices[moved, 0] > 0.2)
    assert not beyond.any()


def test_a_goal_across_an_opening_is_reached_around_it():
    x, y = MESH.vertices[MESH.faces].mean(axis=1)[:, :2].T
    slit = TriangleMesh(MESH.vertices, MESH.faces[~((np.abs(y) < 0.05) & (x > 0.0))])
    found = through_pairs(identity(slit, 0.0), slit, slit, pairs(slit, slit, [((0.2, -0.12), (0.2, 0.12))]))
    assert found.followed.all()
    assert found.left[0] < 1e-3


def test_pairs_on_parts_that_do_not_belong_together_are_never_followed():
    two = TriangleMesh(
        np.vstack([MESH.vertices, MESH.vertices + np.array([3.0, 0.0, 0.0])]),
        np.vstack([MESH.faces, MESH.faces + len(MESH.vertices)]),
    )
    found = through_pairs(
        identity(two, 0.1), two, two, pairs(two, two, [((3.1, 0), (0, 0)), ((3.1, 0.1), (3.0, 0.1))]), follow_all=True
    )
    assert found.followed.tolist() == [False, True]
    assert found.missed[0] == np.inf


def test_the_seams_of_a_file_do_not_stop_a_pair():
    """Every triangle with corners of its own, as some files have them."""
    loose = TriangleMesh(MESH.vertices[MESH.faces].reshape(-1, 3), np.arange(MESH.faces.size).reshape(-1, 3))
    given = identity(MESH, 0.1)
    found = Correspondence(
        given.face, given.barycentric, given.matched, given.confidence, loose.faces, len(loose.vertices)
    )
    found = through_pairs(found, loose, MESH, pairs(loose, MESH, [((0.3, 0.1), (0.1, 0.0))]))
    assert found.left[0] < 1e-4
    assert found.folded == 0


def test_a_map_of_other_meshes_is_refused():
    with pytest.raises(ValueError, match="not one between"):
        through_pairs(identity(MESH, 0.9), MESH, sheet(5)[0], pairs(MESH, MESH, [((0, 0), (0, 0))]))
