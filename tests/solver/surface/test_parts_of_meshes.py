"""What parts a mesh falls into, and each as a mesh of its own."""

import numpy as np
from assembled import assembled, ball, card
from surfaces import spherical_cap

from solver import TriangleMesh, cleaned
from solver.surface.parts import Parts

SKIN = spherical_cap(12, 1.2)[0]


def parts_of(mesh: TriangleMesh) -> Parts:
    return Parts.of(mesh, cleaned(mesh, largest_part=True, fill_holes=True))


def cut_open(mesh: TriangleMesh, faces: np.ndarray) -> TriangleMesh:
    """The mesh as a file has it that repeats the vertices along a seam: the chosen faces have vertices of their own."""
    again = mesh.faces.copy()
    again[faces] += len(mesh.vertices)
    return TriangleMesh(np.concatenate([mesh.vertices, mesh.vertices]), again, mesh.name)


def test_the_main_part_is_first_and_others_follow_by_area() -> None:
    mesh = assembled(ball((0, 0, 3), 0.1), SKIN, card((0, 0, 2), (0.5, 0.5)), ball((2, 0, 0), 0.3))
    found = parts_of(mesh)
    assert len(found) == 4
    assert (np.diff(found.area[1:]) <= 0).all()
    first = np.cumsum([0, *(len(x.vertices) for x in (ball((0, 0, 0), 1), SKIN, card((0, 0, 0), (1, 1))))])
    assert found.of_vertex[first].tolist() == [3, 0, 2, 1]
    assert found.of_vertex[mesh.faces].tolist() == np.repeat(found.of_face[:, None], 3, axis=1).tolist()
    assert found.shape.tolist() == [[1, 1], [2, 0], [1, 1], [2, 0]]


def test_moments_are_those_of_the_surface() -> None:
    mesh = assembled(SKIN, ball((2, 1, 0), 0.3), card((0, 0, 2), (0.5, 0.2), 0.7))
    found = parts_of(mesh)
    rng = np.random.default_rng(0)
    for number in range(len(found)):
        part = found.part(number).mesh
        face = rng.choice(len(part.faces), 200_000, p=part.face_areas / part.area)
        points = np.einsum("qk,qkd->qd", rng.dirichlet(np.ones(3), len(face)), part.vertices[part.faces[face]])
        size = np.sqrt(np.trace(found.moments[1][number]))
        assert np.abs(points.mean(axis=0) - found.moments[0][number]).max() < 0.01 * size
        assert np.abs(np.cov(points.T) - found.moments[1][number]).max() < 0.01 * size**2


def test_a_part_is_whole_and_faces_outward() -> None:
    eye = ball((0, 0, 3), 0.2)
    for faces in (eye.faces, eye.faces[:, ::-1]):
        found = parts_of(assembled(SKIN, TriangleMesh(eye.vertices, faces)))
        part = found.part(1)
        centred = part.mesh.vertices - [0, 0, 3]
        assert np.einsum("mi,mi->", part.mesh.face_vectors, centred[part.mesh.faces[:, 0]]) > 0
        where = np.array([[0.2, 0.3, 0.5]] * len(part.faces))
        own, weights = part.in_own_corners(np.arange(len(part.faces)), where)
        here = np.einsum("qk,qkd->qd", where, part.mesh.vertices[part.mesh.faces])
        there = np.einsum("qk,qkd->qd", weights, found.mesh.vertices[found.mesh.faces[own]])
        assert np.allclose(here, there)


def test_parts_that_touch_along_edges_are_two_unless_the_file_cuts_everything_open() -> None:
    eye = ball((0, 0, 3), 0.2)
    upper = eye.vertices[eye.faces].mean(axis=1)[:, 2] > 3
    halves = cut_open(eye, np.flatnonzero(upper))
    assert len(parts_of(assembled(SKIN, halves))) == 3
    skin_in_halves = cut_open(SKIN, np.flatnonzero(SKIN.vertices[SKIN.faces].mean(axis=1)[:, 0] > 0))
    found = parts_of(assembled(skin_in_halves, halves))
    assert len(found) == 2
    part = found.part(1)
    assert len(part.mesh.vertices) == len(eye.vertices)
    assert (part.mesh.twins >= 0).all()
    assert len(part.vertices) > len(eye.vertices)
    assert np.array_equal(part.mesh.vertices[part.rows], found.mesh.vertices[part.vertices])


def test_parts_with_a_vertex_in_common_are_two() -> None:
    one, other = ball((0, 0, 3), 0.2), ball((0, 0, 3.4), 0.2)
    mesh = assembled(SKIN, one, other)
    top = len(SKIN.vertices) + len(one.vertices) - 2
    bottom = len(SKIN.vertices) + len(one.vertices) + len(other.vertices) - 1
    faces = np.where(mesh.faces == bottom, top, mesh.faces)
    found = parts_of(TriangleMesh(mesh.vertices, faces))
    assert len(found) == 3
    assert {len(found.part(k).mesh.vertices) for k in (1, 2)} == {len(one.vertices)}
    assert found.of_vertex[top] == 1
    assert found.of_vertex[bottom] == -1


def test_a_mesh_of_one_part() -> None:
    found = parts_of(SKIN)
    assert len(found) == 1
    assert (found.of_face == 0).all()
