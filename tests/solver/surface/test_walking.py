"""Nearest places found by going over a surface, against all faces of it."""

import numpy as np
import pytest
from correspondences import sheet

from solver import TriangleMesh
from solver.surface.nearest import nearest_in_triangle
from solver.surface.walking import faces_beyond, nearest_from


def waved(mesh: TriangleMesh) -> TriangleMesh:
    x, y, _ = mesh.vertices.T
    return TriangleMesh(np.stack([x, y, 0.1 * np.sin(4 * x) * np.cos(3 * y)], axis=1), mesh.faces)


@pytest.mark.parametrize("seed", range(3))
def test_from_anywhere_on_a_gentle_surface_the_nearest_of_all_faces_is_found(seed: int) -> None:
    mesh = waved(sheet(13)[0])
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-1.1, 1.1, (40, 2)), rng.uniform(-0.1, 0.1, 40)])
    starts = rng.integers(0, len(mesh.faces), (40, 1))
    face, place, off = nearest_from(mesh, faces_beyond(mesh), starts, points)
    corners = mesh.vertices[mesh.faces]
    assert np.allclose(np.linalg.norm(np.einsum("qk,qkd->qd", place, corners[face]) - points, axis=1), off)
    for point, found in zip(points, off, strict=True):
        every = np.einsum("fk,fkd->fd", nearest_in_triangle(np.tile(point, (len(corners), 1)), corners), corners)
        assert found == pytest.approx(np.linalg.norm(every - point, axis=1).min(), abs=1e-12)


def test_the_other_lip_is_not_come_to_through_the_air() -> None:
    """Two sheets above each other in one mesh: from a face of the lower one the place is on the lower one."""
    one = sheet(9)[0]
    count = len(one.vertices)
    both = TriangleMesh(
        np.concatenate([one.vertices, one.vertices + np.array([0, 0, 0.1])]),
        np.concatenate([one.faces, one.faces + count]),
    )
    points = np.array([[0.2, 0.1, 0.09], [-0.5, 0.3, 0.08]])
    starts = np.array([[3, 10], [3, len(one.faces) + 5]])
    face, _, off = nearest_from(both, faces_beyond(both), starts, points)
    assert face[0] < len(one.faces) <= face[1]
    assert off == pytest.approx([0.09, 0.02])
