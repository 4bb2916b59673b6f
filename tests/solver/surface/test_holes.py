import numpy as np
import pytest
from surfaces import largest_error, planar, rings

from solver import MeshError, TriangleMesh, flatten, topology
from solver.surface.holes import cyclic_polygon, filled


def punched(mesh: TriangleMesh, *holes: tuple[complex, float]) -> TriangleMesh:
    """Leave out the faces of a planar mesh whose centres lie in given circles."""
    centre = (mesh.vertices @ [1, 1j, 0])[mesh.faces].mean(axis=1)
    gone = np.any([np.abs(centre - z) < radius for z, radius in holes], axis=0)
    return TriangleMesh(mesh.vertices, mesh.faces[~gone], "Scan.003")


def slit(mesh: TriangleMesh, path: np.ndarray) -> TriangleMesh:
    """Cut a planar mesh open along a path of edges; its two ends stay whole."""
    inner = path[1:-1]
    double = np.arange(len(mesh.vertices))
    double[inner] = len(mesh.vertices) + np.arange(len(inner))
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    above = centre[:, 1] > mesh.vertices[path[0], 1]
    faces = mesh.faces.copy()
    faces[above] = double[faces[above]]
    return TriangleMesh(np.concatenate([mesh.vertices, mesh.vertices[inner]]), faces, "slit")


def square_grid(n: int) -> TriangleMesh:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n))
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 2], axis=1), np.stack([a, a + n + 2, a + n + 1], axis=1)])
    return TriangleMesh(np.stack([x, y, 0 * x], axis=1), faces, "square")


@pytest.mark.parametrize("seed", range(20))
def test_a_polygon_has_its_side_lengths(seed):
    rng = np.random.default_rng(seed)
    sides = rng.uniform(0.01, 1, rng.integers(3, 60)) ** 2
    longest = np.argmax(sides)
    sides[longest] = min(sides[longest], 0.98 * np.delete(sides, longest).sum())
    corners = cyclic_polygon(sides)
    assert np.abs(np.roll(corners, -1) - corners) == pytest.approx(sides)
    assert np.ptp(np.abs(corners)) < 1e-9 * np.abs(corners).max()
    turn = np.angle((np.roll(corners, -2) - np.roll(corners, -1)) / (np.roll(corners, -1) - corners))
    assert turn.min() > 0
    assert turn.sum() == pytest.approx(2 * np.pi)


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.5])
def test_a_filled_surface_is_a_disc_with_triangles_in_every_place(radius):
    mesh = punched(planar(rings(30)), (0.2, radius))
    outer, hole = topology(mesh).boundary_loops
    faces, lengths, count = filled(mesh, [hole])
    assert (faces[: len(mesh.faces)] == mesh.faces).all()
    assert (2 * lengths.max(axis=1) < lengths.sum(axis=1)).all()
    flat = TriangleMesh(np.random.default_rng(0).uniform(size=(count, 3)), faces)
    assert topology(flat).is_disc
    assert set(topology(flat).boundary_loops[0]) == set(outer)


def test_a_disc_with_round_holes_is_mapped_as_without_them():
    points = rings(40)
    mesh = punched(planar(points), (0.45, 0.2), (-0.3 + 0.4j, 0.12))
    flattening = flatten(mesh, fill_holes=True)
    assert sorted(len(hole) for hole in flattening.holes) == sorted(
        len(loop) for loop in topology(mesh).boundary_loops[1:]
    )
    assert flattening.mesh is mesh
    assert len(flattening.disc) == len(points)
    used = np.unique(mesh.faces)
    assert (np.isnan(flattening.disc) == ~np.isin(np.arange(len(points)), used)).all()
    kept = TriangleMesh(mesh.vertices[used], np.searchsorted(used, mesh.faces))
    assert largest_error(flattening.disc[used], points[used], kept) < 0.02
    assert flattening.distortion.flips == 0


def test_bending_changes_nothing():
    flat = punched(square_grid(24), (0.5 + 0.4j, 0.15))
    x, y, _ = flat.vertices.T
    bent = TriangleMesh(np.stack([np.sin(2 * x) / 2, y, np.cos(2 * x) / 2], axis=1), flat.faces)
    one, other = (flatten(mesh, fill_holes=True).disc for mesh in (flat, bent))
    used = np.unique(flat.faces)
    turn = np.vdot(one[used], other[used])
    assert np.abs(one[used] * turn / abs(turn) - other[used]).max() < 5e-3


def test_a_closed_mouth_does_not_fold():
    n = 20
    mesh = square_grid(n)
    path = (n // 2) * (n + 1) + np.arange(4, n - 3)
    mouth = slit(mesh, path)
    assert len(topology(mouth).boundary_loops) == 2
    flattening = flatten(mouth, fill_holes=True)
    assert flattening.distortion.flips == 0
    lips = flattening.disc[path[1:-1]], flattening.disc[len(mesh.vertices) :]
    assert np.abs(lips[0] - lips[1]).min() > 0


def test_the_smallest_hole_is_a_missing_triangle():
    points = rings(10)
    whole = planar(points)
    inner = np.flatnonzero((np.abs(points[whole.faces]) < 0.6).all(axis=1))[3]
    mesh = TriangleMesh(whole.vertices, np.delete(whole.faces, inner, axis=0))
    assert largest_error(flatten(mesh, fill_holes=True).disc, points, mesh) < 0.01


def test_the_outer_loop_is_the_longest_or_the_one_that_is_named():
    mesh = punched(planar(rings(30)), (0, 0.5))
    outer, hole = topology(mesh).boundary_loops
    assert set(flatten(mesh, fill_holes=True).boundary) == set(outer)
    inside_out = flatten(mesh, fill_holes=True, outer_vertex=int(hole[3]))
    assert set(inside_out.boundary) == set(hole)
    assert inside_out.distortion.flips == 0
    # the disc without a disc turned inside out is 1/z
    used = np.unique(mesh.faces)
    truth = 1 / (mesh.vertices @ [1, 1j, 0])[used]
    kept = TriangleMesh(mesh.vertices[used], np.searchsorted(used, mesh.faces))
    assert largest_error(inside_out.disc[used], truth / np.abs(truth).max(), kept) < 0.1
    inner = int(np.setdiff1d(used, np.concatenate([outer, hole]))[0])
    with pytest.raises(MeshError, match=rf"^'Scan.003' has vertex {inner} on none of its boundary loops"):
        flatten(mesh, fill_holes=True, outer_vertex=inner)


def test_holes_are_refused_unless_asked_for():
    mesh = punched(planar(rings(20)), (0, 0.3))
    with pytest.raises(MeshError, match="2 boundary loops"):
        flatten(mesh)


def test_a_face_with_mouth_and_eyes_open(real_mesh):
    flattening = flatten(real_mesh("faces_ict/ict_neutral_with_holes.obj"), fill_holes=True)
    assert sorted(map(len, flattening.holes)) == [42, 42, 74]
    assert flattening.distortion.flips == 0
    assert flattening.distortion.mean_angle_error < 1.6


@pytest.mark.parametrize("size", [0.02, 0.05, 0.1])
def test_a_tooth_with_openings_is_mapped_as_without_them(real_mesh, size):
    whole = real_mesh("teeth/K04.obj")
    reference = flatten(whole).disc
    centre = whole.vertices[np.argsort(np.abs(reference))[[5, 900]]]
    away = np.linalg.norm(whole.vertices[whole.faces].mean(axis=1)[:, None] - centre, axis=2) < size * whole.diagonal
    mesh = TriangleMesh(whole.vertices, whole.faces[~away.any(axis=1)])
    flattening = flatten(mesh, fill_holes=True)
    used = np.unique(mesh.faces)
    kept = TriangleMesh(mesh.vertices[used], np.searchsorted(used, mesh.faces))
    assert flattening.distortion.flips == 0
    assert largest_error(flattening.disc[used], reference[used], kept) < 0.6 * size + 0.01
