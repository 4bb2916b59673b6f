import numpy as np
import pytest
from scans import bumps, similarity

from solver import TriangleMesh
from solver.carry.symmetry import Mirror, left_share

SCALE, TURN, SHIFT = similarity(np.random.default_rng(2))


def symmetric_surface(count: int = 900) -> TriangleMesh:
    """One half of a bumpy sheet and its mirror image in x, not joined, in another pose."""
    half = bumps(count, 4)
    faces = half.faces[(half.vertices[half.faces][:, :, 0] > 0.02).all(axis=1)]
    used, local = np.unique(faces, return_inverse=True)
    right, local = half.vertices[used], local.reshape(-1, 3)
    both = np.concatenate([right, right * [-1, 1, 1]])
    faces = np.concatenate([local, local[:, ::-1] + len(right)])
    return TriangleMesh(SCALE * both @ TURN + SHIFT, faces)


def test_the_plane_is_found_in_any_pose_and_the_image_is_exact() -> None:
    mesh = symmetric_surface()
    mirror = Mirror.of(mesh)
    assert mirror is not None
    wanted = np.array([1.0, 0, 0]) @ TURN
    assert abs(mirror.normal @ wanted) == pytest.approx(1, abs=1e-9)
    assert (mirror.middle - SHIFT) @ wanted == pytest.approx(0, abs=1e-8)
    values = np.random.default_rng(0).normal(size=(len(mesh.vertices), 3))
    image = mirror.image(values)
    half = len(values) // 2
    own = values @ TURN.T * [-1, 1, 1] @ TURN
    assert np.abs(image - np.concatenate([own[half:], own[:half]])).max() < 1e-6
    assert np.abs(mirror.image(image) - values).max() < 1e-6
    first, second = mirror.symmetric(values, image + 0.1 * values[::-1])
    assert np.abs(mirror.image(first) - second).max() < 1e-6
    assert mirror.alike(values, image)
    assert not mirror.alike(values, -image)


def test_what_is_not_symmetric_has_no_plane() -> None:
    mesh = bumps(700, 4)
    tilted = mesh.vertices + 0.5 * np.sin(3 * mesh.vertices[:, [1, 2, 0]]) * [0.3, 1, 1]
    tilted += mesh.vertices[:, :1] * [0, 0.5, 0.4]
    assert Mirror.of(TriangleMesh(tilted, mesh.faces)) is None


def test_halves_add_up_and_meet_in_the_middle() -> None:
    places = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    normal = np.array([0.6, 0.0, 0.8])
    left, right = left_share(places, normal, 0.1 * normal, 0.4), left_share(places, -normal, 0.1 * normal, 0.4)
    assert left + right == pytest.approx(1)
    far = (places - 0.1 * normal) @ normal
    assert (left[far > 0.2] == 1).all()
    assert (left[far < -0.2] == 0).all()
    assert left_share(0.1 * normal[None], normal, 0.1 * normal, 0.4) == pytest.approx(0.5)
