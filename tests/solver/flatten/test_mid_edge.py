import numpy as np
import pytest
from surfaces import largest_error, spherical_cap

from solver import MeshError, Mobius, TriangleMesh, flatten, topology
from solver.flatten.barycentre import conformal_barycentre
from solver.flatten.mid_edge import _conjugate, _dipole, _inner_face, mid_edge_map
from solver.surface.intrinsic_delaunay import IntrinsicTriangulation
from solver.surface.mesh import twin_sides

TEETH = ["H10", "H19", "K04", "K05", "P31", "P35", "T14", "U02", "U08", "i14", "i15", "x02", "x07", "x17"]


def intrinsic(mesh: TriangleMesh) -> IntrinsicTriangulation:
    return IntrinsicTriangulation(mesh.faces, mesh.edge_lengths, twin_sides(mesh.edge_of_side), len(mesh.vertices))


def test_the_triangles_between_midpoints_are_mapped_by_similarities():
    mesh, _ = spherical_cap(8, 1.5, jitter=0.3)
    surface, boundary = intrinsic(mesh), topology(mesh).boundary_loops[0]
    pole = _inner_face(surface, boundary)
    kept = np.delete(np.arange(len(mesh.faces)), pole)
    u = _dipole(mesh.faces[kept], mesh.edge_lengths[kept], len(mesh.vertices), mesh.faces[pole])
    conjugate, edge = _conjugate(surface, kept, u)
    corner = u[mesh.faces[kept]]
    middles = (corner.sum(axis=1, keepdims=True) - corner) / 2 + 1j * conjugate[edge].reshape(-1, 3)
    image = np.abs(np.roll(middles, -1, axis=1) - np.roll(middles, 1, axis=1))
    ratio = image / mesh.edge_lengths[kept]
    assert np.ptp(ratio, axis=1) == pytest.approx(np.zeros(len(kept)), abs=1e-9 * ratio.max())


@pytest.mark.parametrize("polar_angle", [0.5, 1.5, 2.5])
def test_a_spherical_cap_is_projected_stereographically(polar_angle):
    mesh, truth = spherical_cap(40, polar_angle, jitter=0.2)
    assert largest_error(flatten(mesh, "mid-edge").disc, truth, mesh) < 0.02


def test_it_converges():
    errors = []
    for count in (10, 20, 40):
        mesh, truth = spherical_cap(count, 1.0, jitter=0.2)
        errors.append(largest_error(flatten(mesh, "mid-edge").disc, truth, mesh))
    assert errors[0] > 1.5 * errors[1] > 2.2 * errors[2]


def test_the_boundary_is_on_the_circle_in_order():
    mesh, _ = spherical_cap(20, 2.0, jitter=0.2)
    flattening = flatten(mesh, "mid-edge")
    rim = flattening.disc[flattening.boundary]
    assert np.abs(np.abs(rim) - 1).max() < 1e-15
    assert np.angle(np.roll(rim, -1) / rim).min() > 0
    assert flattening.distortion.flips == 0


def test_a_mesh_without_an_inner_face_is_refused():
    square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], "Scan")
    with pytest.raises(MeshError, match=r"^'Scan' is too coarse for the method 'mid-edge'"):
        flatten(square, "mid-edge")


def median_distance(one: np.ndarray, other: np.ndarray, weights: np.ndarray) -> float:
    """Median distance of two discs, each centred, after the best rotation."""
    one, other = (Mobius(conformal_barycentre(x, weights), 0)(x) for x in (one, other))
    turn = np.vdot(one, weights * other)
    return float(np.median(np.abs(one * turn / abs(turn) - other)))


@pytest.mark.parametrize("name", TEETH)
def test_it_is_the_authors_own_map(real_mesh, data_path, name):
    mesh = real_mesh(f"teeth/{name}.obj")
    theirs = np.load(data_path(f"teeth/{name}_disc.npy")).astype(float) @ [1, 1j]
    theirs /= np.maximum(np.abs(theirs), 1)
    ours = mid_edge_map(intrinsic(mesh), topology(mesh).boundary_loops[0])
    distance = median_distance(ours, theirs, mesh.vertex_areas)
    harmonic = median_distance(flatten(mesh).disc, theirs, mesh.vertex_areas)
    print(f"{name}: mid-edge {distance:.5f}, harmonic {harmonic:.5f} from the authors' map")  # noqa: T201
    assert distance < 0.0008
    assert harmonic < 0.0025
    assert flatten(mesh, "mid-edge").distortion.flips == 0
