"""The map the other way."""

import numpy as np
import pytest
from correspondences import planar_correspondence, sheet

from solver import Correspondence, TriangleMesh
from solver.carry.inverse import inverted


def test_there_and_back_is_where_one_was(pair):
    source, target, found = pair
    back = inverted(found, source, target)
    inside = (
        np.abs(source.vertices[:, 0] + 1j * source.vertices[:, 1]) < 0.75
    )  # the target is smaller, and its rim has corners
    assert (back.matrix() @ target.vertices)[inside] == pytest.approx(source.vertices[inside], abs=1e-9)
    assert back.matched[inside].all()
    assert not back.matched[np.abs(source.vertices[:, 0] + 1j * source.vertices[:, 1]) > 0.99].any()


def test_a_mirrored_map_is_inverted_too():
    mesh, other = sheet(21)[0], sheet(16)[0]
    flipped = TriangleMesh(other.vertices * [-1, 1, 1], other.faces[:, [0, 2, 1]])
    found = planar_correspondence(mesh, other)
    back = inverted(found, mesh, flipped)
    assert back.matrix() @ flipped.vertices == pytest.approx(mesh.vertices * [-1, 1, 1], abs=1e-9)


def test_parts_keep_to_their_own_and_those_without_a_counterpart_ride():
    one = sheet(11)[0]
    size, count = len(one.vertices), len(one.faces)
    shifts = np.array([[0, 0, 0], [0, 0, 0.01], [0, 0, 0.02]])

    def several(number: int) -> TriangleMesh:
        return TriangleMesh(
            np.vstack([one.vertices + shift for shift in shifts[:number]]),
            np.vstack([one.faces + k * size for k in range(number)]),
        )

    source, target = several(3), several(2)
    alone = planar_correspondence(one, one)
    sure = np.ones(2 * size)
    found = Correspondence(
        np.concatenate([alone.face, alone.face + count]), np.vstack([alone.barycentric] * 2), sure > 0, sure,
        source.faces, 3 * size,
        part=np.repeat([0, 1], size), source_part=np.repeat([0, 1, 2], size), leader=np.full(2 * size, -1),
    )  # fmt: skip
    back = inverted(found, source, target)
    assert (back.matrix() @ target.vertices)[: 2 * size] == pytest.approx(target.vertices, abs=1e-9)
    assert back.matched[: 2 * size].all()
    assert not back.matched[2 * size :].any()
    assert (back.leader[: 2 * size] == -1).all()
    assert (back.leader[2 * size :] >= 0).all()
    assert (back.part == found.source_part).all()


def test_nothing_to_invert_is_refused(pair):
    source, target, found = pair
    none = Correspondence(
        np.full_like(found.face, -1), 0 * found.barycentric, ~found.matched, 0 * found.confidence, source.faces,
        len(source.vertices),
    )  # fmt: skip
    with pytest.raises(ValueError, match="no triangle"):
        inverted(none, source, target)
