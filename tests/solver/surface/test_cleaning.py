import numpy as np
import pytest
from surfaces import planar, rings, spherical_cap

from solver import MeshError, TriangleMesh, flatten, topology
from solver.surface.cleaning import cleaned


def test_a_mesh_in_order_is_itself():
    mesh = planar(rings(4))
    result = cleaned(mesh, largest_part=True)
    assert result.mesh is mesh
    assert result.changes == ()
    assert (result.faces == np.arange(len(mesh.faces))).all()


def test_random_orientations_become_one():
    mesh, _ = spherical_cap(8, 1.2)
    rng = np.random.default_rng(1)
    mixed = mesh.faces.copy()
    wrong = rng.uniform(size=len(mixed)) < 0.4
    mixed[wrong] = mixed[wrong][:, ::-1]
    result = cleaned(TriangleMesh(mesh.vertices, mixed))
    assert topology(result.mesh).is_disc
    assert (result.reversed == wrong).all()
    assert result.changes == (f"{wrong.sum()} faces turned over",)
    assert result.mesh.vertex_normals()[0, 2] > 0.9
    assert flatten(result.mesh).disc == pytest.approx(flatten(mesh).disc, abs=1e-9)


def test_degenerate_and_duplicate_faces_are_left_out():
    mesh = planar(rings(4))
    dirty = np.concatenate(
        [mesh.faces[:9], [[3, 3, 5]], mesh.faces[2:4][:, [1, 2, 0]], mesh.faces[9:], [mesh.faces[7][::-1]]]
    )
    result = cleaned(TriangleMesh(mesh.vertices, dirty))
    assert (result.mesh.faces == mesh.faces).all()
    assert (dirty[result.faces] == mesh.faces).all()
    assert result.changes == ("1 face with a vertex used twice left out", "3 duplicate faces left out")


def test_the_largest_part_is_kept_on_request():
    small, _ = spherical_cap(9, 1.0)
    large = planar(rings(3) * 5)
    n = len(small.vertices)
    both = TriangleMesh(
        np.concatenate([small.vertices, large.vertices]), np.concatenate([small.faces, large.faces + n])
    )
    assert topology(cleaned(both).mesh).parts == 2
    result = cleaned(both, largest_part=True)
    assert (result.mesh.faces == large.faces + n).all()
    assert result.changes == ("1 smaller part left out",)
    disc = flatten(result.mesh).disc
    assert np.isnan(disc[:n]).all()
    assert not np.isnan(disc[n:]).any()


def test_parts_that_touch_in_a_vertex_are_two():
    vertices = np.array([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-2, -2, 0], [-2, 2, 0]], float)
    result = cleaned(TriangleMesh(vertices, [[0, 2, 1], [0, 4, 3]]), largest_part=True)
    assert result.mesh.faces.tolist() == [[0, 4, 3]]


def test_a_strip_with_one_side_is_refused():
    n = 12
    t = 2 * np.pi * np.arange(n) / n
    across = np.stack([np.cos(t / 2) * np.cos(t), np.cos(t / 2) * np.sin(t), np.sin(t / 2)], axis=1)
    middle = np.stack([3 * np.cos(t), 3 * np.sin(t), 0 * t], axis=1)
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    a, b, c, d = i, j, j + n, i + n
    b[-1], c[-1] = n, 0
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    with pytest.raises(MeshError, match=r"^'Ribbon' has one side only"):
        cleaned(TriangleMesh(np.concatenate([middle + across, middle - across]), faces, "Ribbon"))


def test_nothing_left_is_refused():
    with pytest.raises(MeshError, match="only faces that use a vertex twice"):
        cleaned(TriangleMesh(np.eye(3), [[0, 1, 1]], "Scan"))
