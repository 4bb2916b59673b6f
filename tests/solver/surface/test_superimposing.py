"""The pose that brings points nearest to others."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.surface.superimposing import superimposing


def test_superimposing_undoes_a_pose() -> None:
    rng = np.random.default_rng(1)
    points, weights = rng.normal(size=(30, 3)), rng.uniform(0.1, 1, 30)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for mirror in (False, True):
        turn[:, 0] *= np.sign(np.linalg.det(turn)) * (-1 if mirror else 1)
        onto = 2.5 * points @ turn + [1, 2, 3]
        pose = superimposing(points, onto, weights, mirrored=mirror, scaled=True)
        np.testing.assert_allclose(pose(points), onto, atol=1e-12)
        assert pose.scale == pytest.approx(2.5)
        wrong = superimposing(points, onto, weights, mirrored=not mirror, scaled=True)
        assert np.linalg.norm(wrong(points) - onto) > 1


def test_without_scale_the_size_stays_and_the_middles_meet() -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(30, 3))
    pose = superimposing(points, 3 * points + [1, 2, 3])
    assert pose.scale == 1
    np.testing.assert_allclose(pose.turn, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(pose(points).mean(axis=0), 3 * points.mean(axis=0) + [1, 2, 3])


def test_no_other_pose_is_nearer() -> None:
    rng = np.random.default_rng(5)
    points, onto, weights = rng.normal(size=(20, 3)), rng.normal(size=(20, 3)), rng.uniform(0.1, 1, 20)
    pose = superimposing(points, onto, weights, scaled=True)

    def apart(places: np.ndarray) -> float:
        return float(weights @ ((places - onto) ** 2).sum(axis=1))

    least = apart(pose(points))
    for _ in range(200):
        turn = pose.turn @ Rotation.from_rotvec(0.1 * rng.normal(size=3)).as_matrix()
        other = pose.scale * rng.uniform(0.9, 1.1) * points @ turn + pose.shift + 0.05 * rng.normal(size=3)
        assert apart(other) >= least


def test_the_matrix_is_the_pose() -> None:
    rng = np.random.default_rng(6)
    points = rng.normal(size=(10, 3))
    pose = superimposing(points, rng.normal(size=(10, 3)), mirrored=True, scaled=True)
    np.testing.assert_allclose(points @ pose.matrix[:3, :3].T + pose.matrix[:3, 3], pose(points))
    assert np.linalg.det(pose.matrix[:3, :3]) < 0
