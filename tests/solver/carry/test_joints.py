import numpy as np
import pytest
from correspondences import on_itself, sheet

from solver import TriangleMesh
from solver.align.parts.space import MOST_POINTS
from solver.carry.joints import carried_joints


def dome(n: int) -> TriangleMesh:
    flat, _ = sheet(n)
    return TriangleMesh(flat.vertices + [0, 0, 1] * np.cos(1.3 * flat.vertices[:, :1]), flat.faces)


@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("n", [3, 15, 100])
def test_joints_of_a_similar_surface_go_by_the_similarity(mirror, n):
    source = dome(n)
    assert n < 100 or len(source.vertices) > MOST_POINTS
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= mirror * np.sign(np.linalg.det(turn))
    target = TriangleMesh(2.5 * source.vertices @ turn.T + [1, 2, 3], source.faces[:, ::mirror])
    # below the surface, on a vertex, far outside; moving all, nothing, one vertex
    joints = np.array([[0.1, 0.2, 0.3], source.vertices[4], [5.0, -7, 9]])
    influence = np.zeros((len(source.vertices), 3))
    influence[:, 0], influence[4, 2] = 1, 1
    found = carried_joints(
        on_itself(source, 0), source, target, joints, np.full(3, 0.2), influence, mirrored=mirror < 0
    )
    assert found(joints) == pytest.approx(2.5 * joints @ turn.T + [1, 2, 3], abs=1e-9)
    assert np.abs(found.turn - turn).max() < 1e-9


def test_a_joint_goes_with_what_it_moves_and_not_with_what_lies_nearer():
    one, _ = sheet(12)
    count = len(one.vertices)
    # two sheets, one above the other: the lower one turns by a right angle, the upper one is moved
    source = TriangleMesh(
        np.concatenate([one.vertices, one.vertices + np.array([0, 0, 0.2])]),
        np.concatenate([one.faces, one.faces + count]),
    )
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    target = TriangleMesh(np.concatenate([one.vertices @ turn.T, one.vertices + np.array([3, 0, 0.2])]), source.faces)
    joint = np.array([[0.4, 0, 0.19], [0.4, 0, 0.01]])
    influence = np.zeros((2 * count, 2))
    influence[:count, 0] = influence[count:, 1] = 1
    found = carried_joints(on_itself(source, 1), source, target, joint, np.full(2, 0.3), influence)
    places = found(joint)
    assert np.abs(places[0] - [0, 0.4, 0.19]).max() < 0.1
    assert np.abs(places[1] - [3.4, 0, 0.01]).max() < 0.1
    # a joint that moves nothing goes with what is nearest
    joint, nothing = source.vertices[[count + 40]], np.zeros((2 * count, 1))
    found = carried_joints(on_itself(source, 1), source, target, joint, np.array([0.01]), nothing)
    assert np.abs(found(joint) - target.vertices[count + 40]).max() < 0.01


def test_what_corresponds_to_nothing_moves_no_joint():
    source = dome(6)
    nothing = on_itself(source, 0)
    nothing.face[:] = -1
    with pytest.raises(ValueError, match="no vertex of the target has a counterpart"):
        carried_joints(nothing, source, source, np.zeros((1, 3)), np.ones(1), np.ones((36, 1)))
