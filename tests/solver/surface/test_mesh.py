import numpy as np
import pytest
from scans import bumps
from surfaces import spherical_cap

from solver import MeshError, TriangleMesh
from solver.surface.mesh import directed_edges, edges_of_sides, face_neighbours

TRIANGLE = ([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])


def test_quantities_of_a_right_triangle():
    mesh = TriangleMesh(*TRIANGLE)
    assert mesh.area == pytest.approx(6)
    assert mesh.edge_lengths.tolist() == [[5, 4, 3]]
    assert mesh.vertex_areas.tolist() == [2, 2, 2]
    assert mesh.vertex_normals().tolist() == [[0, 0, 1]] * 3
    assert mesh.edges.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert mesh.diagonal == pytest.approx(5)


def test_a_cap_of_the_sphere_has_its_area_and_normals():
    mesh, _ = spherical_cap(40, 1.0)
    assert mesh.area == pytest.approx(2 * np.pi * (1 - np.cos(1.0)), rel=2e-3)
    interior = np.linalg.norm(mesh.vertices[:, :2], axis=1) < np.sin(0.9)
    assert np.einsum("ij,ij->i", mesh.vertex_normals(), mesh.vertices)[interior].min() > 0.999


def test_loose_vertices_have_no_normal_and_no_area():
    mesh = TriangleMesh([*TRIANGLE[0], [9, 9, 9]], TRIANGLE[1])
    assert mesh.vertex_normals()[3].tolist() == [0, 0, 0]
    assert mesh.vertex_areas[3] == 0
    assert mesh.diagonal == pytest.approx(5)


def test_the_fingerprint_is_of_positions_and_faces_alone():
    vertices, faces = TRIANGLE
    print_of = TriangleMesh(vertices, faces).fingerprint
    # the number itself is kept, so that files written on one platform or by one version are known on another
    assert print_of == "92c7a931286f33b24d825eb55a95c0bd"
    assert TriangleMesh(np.array(vertices, ">f4"), np.array(faces, np.uint16), "other").fingerprint == print_of
    assert TriangleMesh(np.asfortranarray(np.array(vertices) * -0.0 + vertices), faces).fingerprint == print_of
    different = [
        (vertices, [[1, 2, 0]]),
        (vertices[1:] + vertices[:1], [[2, 0, 1]]),
        ([*vertices, [9, 9, 9]], faces),
        (vertices, [*faces, *faces]),
        ([*vertices[:2], [0, np.nextafter(4, 5), 0]], faces),
    ]
    assert len({print_of, *(TriangleMesh(*arrays).fingerprint for arrays in different)}) == 6


@pytest.mark.parametrize(
    ("vertices", "faces", "reason"),
    [
        ([], [[0, 1, 2]], "has no vertices"),
        (TRIANGLE[0], np.zeros((0, 3), int), "has no faces"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "shape"),
        (TRIANGLE[0], [[0, 1, 2, 2]], "shape"),
        (TRIANGLE[0], [[0.0, 1.0, 2.0]], "integer"),
        (TRIANGLE[0], [[0, 1, 3]], "outside 0 to 2"),
        (TRIANGLE[0], [[0, 1, -1]], "outside 0 to 2"),
        ([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]], [[0, 1, 2]], "1 vertex whose position is not a finite number"),
    ],
)
def test_unusable_arrays_are_refused_by_name(vertices, faces, reason):
    with pytest.raises(MeshError, match=reason) as refusal:
        TriangleMesh(vertices, faces, "Scan.003")
    assert str(refusal.value).startswith("'Scan.003' ")


def test_a_moved_mesh_keeps_what_is_known_of_its_edges():
    mesh = bumps(200, seed=1)
    twins, edges = mesh.twins, mesh.edges
    moved = mesh.moved(2 * mesh.vertices)
    assert moved.twins is twins
    assert moved.edges is edges
    assert moved.edge_lengths == pytest.approx(2 * mesh.edge_lengths)
    assert moved.area == pytest.approx(4 * mesh.area)
    assert (moved.neighbours == face_neighbours(mesh.faces, len(mesh.vertices))).all()


def test_edges_are_sorted_and_each_is_there_once():
    faces = np.random.default_rng(0).integers(0, 30, (60, 3))
    edges, edge_of_side = edges_of_sides(faces, 30)
    ends = np.sort(directed_edges(faces), axis=1)
    assert (edges[edge_of_side] == ends).all()
    assert edges.tolist() == np.unique(ends, axis=0).tolist()
