import numpy as np
import pytest
from correspondences import on_itself, sheet

from solver import TriangleMesh
from solver.carry.frames import local_similarities, nearest_orthogonal


@pytest.mark.parametrize("mirror", [1, -1])
def test_the_local_similarity_of_a_similar_surface_is_the_similarity(mirror):
    flat, _ = sheet(15)
    source = TriangleMesh(flat.vertices + [0, 0, 1] * np.sin(2 * flat.vertices[:, :1]), flat.faces)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= mirror * np.sign(np.linalg.det(turn))
    target = TriangleMesh(2.5 * source.vertices @ turn.T + [1, 2, 3], source.faces[:, ::mirror])
    rotation, scale = local_similarities(on_itself(source, 0), source, target)
    assert np.abs(rotation - turn).max() < 1e-9
    assert scale == pytest.approx(2.5)


@pytest.mark.parametrize("kind", [1, -1])
def test_nearest_orthogonal_matrices_are_those_of_the_singular_values(kind):
    rng = np.random.default_rng(1)
    matrices = rng.normal(size=(400, 3, 3))
    handed = np.sign(np.linalg.det(matrices))
    matrices[(handed != kind) & (np.arange(400) > 40), 0] *= -1  # most are of the kind, a tenth is not
    matrices[:3] = np.outer([1, 2, 3], [1, 0, -1])  # of rank one
    matrices[3:6, 2] = matrices[3:6, 1]  # of rank two
    left, _, right = np.linalg.svd(matrices)
    left[np.sign(np.linalg.det(left @ right)) != kind, :, 2] *= -1
    found = nearest_orthogonal(matrices)
    assert np.sign(np.linalg.det(found)) == pytest.approx(kind)
    assert np.abs(found @ found.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    # that of rank one is not determined; the others are the best there are
    assert np.abs(found - left @ right)[3:].max() < 1e-9
    assert (nearest_orthogonal(np.eye(3)[None]) == np.eye(3)).all()
    # nor does it matter how they lie in memory, and they stay as they are
    other = np.ascontiguousarray(matrices.transpose(1, 2, 0)).transpose(2, 0, 1)
    assert (nearest_orthogonal(other) == found).all()
    assert (other == matrices).all()


def test_nearest_orthogonal_matrices_of_many_are_those_of_each():
    matrices = np.random.default_rng(2).normal(size=(5000, 3, 3))
    matrices[np.linalg.det(matrices) < 0, 0] *= -1
    left, _, right = np.linalg.svd(matrices)
    assert np.abs(nearest_orthogonal(matrices) - left @ right).max() < 1e-9
