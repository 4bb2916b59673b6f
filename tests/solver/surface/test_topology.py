import numpy as np
import pytest
from surfaces import planar, rings, spherical_cap

from solver import MeshError, TriangleMesh, require_disc, topology

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)


def annulus(inner_ring: int = 2) -> TriangleMesh:
    mesh = planar(rings(6))
    hole = np.abs(mesh.vertices[mesh.faces, 0] + 1j * mesh.vertices[mesh.faces, 1]).max(axis=1) < (inner_ring + 0.5) / 6
    return TriangleMesh(mesh.vertices, mesh.faces[~hole], "ring")


def torus(n: int = 6) -> TriangleMesh:
    i, j = np.divmod(np.arange(n * n), n)
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / n
    vertices = np.column_stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)])
    a, b = i * n + j, (i + 1) % n * n + j
    c, d = (i + 1) % n * n + (j + 1) % n, i * n + (j + 1) % n
    return TriangleMesh(vertices, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]), "torus")


def test_a_disc():
    mesh = planar(rings(5))
    found = require_disc(mesh)
    assert found.is_disc
    assert found.problems() == ()
    assert found.euler_characteristic == 1
    assert found.parts == 1
    assert found.handles == 0
    assert found.describe() == "disc, 91 vertices, boundary of 30 edges"
    loop = found.boundary_loops[0]
    # in the direction of the surface: counter-clockwise here, each edge between neighbours of the rim
    turned = np.angle(
        np.roll(np.exp(1j * np.angle(mesh.vertices[loop] @ [1, 1j, 0])), -1) / (mesh.vertices[loop] @ [1, 1j, 0])
    )
    assert turned == pytest.approx(np.full(30, 2 * np.pi / 30))
    assert found.loop_lengths[0] == pytest.approx(30 * 2 * np.sin(np.pi / 30))


def test_one_triangle_is_a_disc():
    assert topology(TriangleMesh(CORNERS[:3], [[0, 1, 2]])).boundary_loops[0].size == 3


def refused(mesh: TriangleMesh) -> str:
    assert not topology(mesh).is_disc
    with pytest.raises(MeshError) as refusal:
        require_disc(mesh)
    assert str(refusal.value).startswith(f"'{mesh.name}' ")
    return str(refusal.value)


def test_a_closed_surface():
    found = topology(TriangleMesh(CORNERS, TETRAHEDRON))
    assert (found.euler_characteristic, found.handles, found.boundary_loops) == (2, 0, ())
    assert "closed" in refused(TriangleMesh(CORNERS, TETRAHEDRON))


def test_a_torus_and_one_with_a_hole():
    assert (topology(torus()).euler_characteristic, topology(torus()).handles) == (0, 1)
    opened = TriangleMesh(torus().vertices, torus().faces[1:], "torus")
    assert "1 handle" in refused(opened)
    assert len(topology(opened).boundary_loops) == 1


def test_two_boundary_loops_longest_first():
    found = topology(annulus())
    assert [len(loop) for loop in found.boundary_loops] == [36, 12]
    assert "2 boundary loops (36 and 12 edges)" in refused(annulus())


def test_two_parts():
    cap, _ = spherical_cap(3, 1.0)
    n = len(cap.vertices)
    both = TriangleMesh(np.concatenate([cap.vertices, cap.vertices + 5]), np.concatenate([cap.faces, cap.faces + n]))
    assert topology(both).parts == 2
    assert "2 separate parts" in refused(both)


def test_three_faces_at_an_edge():
    vertices = np.concatenate([CORNERS, [[0, -1, 0]]])
    found = topology(TriangleMesh(vertices, [[0, 1, 2], [1, 0, 3], [1, 0, 4]]))
    assert found.non_manifold_edges.tolist() == [[0, 1]]
    assert "1 edge in three or more faces" in refused(TriangleMesh(vertices, [[0, 1, 2], [1, 0, 3], [1, 0, 4]]))


def test_faces_that_touch_in_a_vertex():
    vertices = np.array([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]], float)
    bow_tie = TriangleMesh(vertices, [[0, 2, 1], [0, 4, 3]])
    assert topology(bow_tie).non_manifold_vertices.tolist() == [0]
    assert "touch in a point" in refused(bow_tie)


def test_faces_that_disagree_about_the_outside():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    wrong = TriangleMesh(square, [[0, 1, 2], [0, 3, 2]])
    assert topology(wrong).inconsistent_edges.tolist() == [[0, 2]]
    assert "disagree about the outside" in refused(wrong)


def test_degenerate_and_duplicate_faces_and_unused_vertices():
    mesh = TriangleMesh(CORNERS, [[0, 1, 2], [0, 1, 1], [2, 0, 1]])
    found = topology(mesh)
    assert found.degenerate_faces.tolist() == [1]
    assert found.duplicate_faces.tolist() == [2]
    assert found.unused_vertices.tolist() == [3]
    text = refused(mesh)
    assert "1 face with a vertex used twice" in text
    assert "1 duplicate face" in text


def test_faces_without_area_and_loose_vertices_are_no_obstacle():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [7, 7, 7]], float)
    found = topology(TriangleMesh(vertices, [[0, 1, 3], [1, 2, 3], [0, 2, 1]]))
    assert found.is_disc
    assert found.zero_area_faces.tolist() == [2]
    assert found.describe() == "disc, 4 vertices, boundary of 3 edges, 1 loose vertex, 1 face without area"


def test_the_order_of_vertices_and_faces_does_not_matter():
    mesh = annulus()
    rng = np.random.default_rng(3)
    order = rng.permutation(len(mesh.vertices))
    place = np.argsort(order)
    shuffled = TriangleMesh(mesh.vertices[order], rng.permutation(place[mesh.faces]))
    for loop, other in zip(topology(mesh).boundary_loops, topology(shuffled).boundary_loops, strict=True):
        assert set(order[other]) == set(loop)
    assert topology(shuffled).euler_characteristic == 0


@pytest.mark.parametrize(
    "name", ["teeth/K04.obj", "teeth_mit/a.ply", "faces_simpop/SIMPOP_01.obj", "scans/chinese_lion.obj"]
)
def test_real_scans_are_discs(real_mesh, name):
    assert topology(real_mesh(name)).is_disc


def test_a_face_with_mouth_and_eyes_open(real_mesh):
    found = topology(real_mesh("faces_ict/ict_neutral_with_holes.obj"))
    assert len(found.boundary_loops) == 4
    assert found.euler_characteristic == -2
    assert found.handles == 0
