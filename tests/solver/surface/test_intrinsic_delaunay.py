import sys

import numpy as np
import pytest
from surfaces import planar

from solver import TriangleMesh, topology
from solver.flatten.distortion import corner_angles
from solver.surface.intrinsic_delaunay import IntrinsicTriangulation, intrinsic_delaunay, without_chords
from solver.surface.laplacian import cotangent_laplacian, cotangents
from solver.surface.mesh import directed_edges, twin_sides


def intrinsic(mesh: TriangleMesh) -> IntrinsicTriangulation:
    return IntrinsicTriangulation(mesh.faces, mesh.edge_lengths, twin_sides(mesh.edge_of_side), len(mesh.vertices))


def angles(triangulation: IntrinsicTriangulation) -> np.ndarray:
    """Angle sum around each vertex."""
    x = np.arctan2(1, cotangents(triangulation.lengths))
    return np.bincount(triangulation.faces.ravel(), x.ravel(), minlength=triangulation.vertex_count)


def assert_well_formed(triangulation: IntrinsicTriangulation) -> None:
    twins, inner = triangulation.twins, np.flatnonzero(triangulation.twins >= 0)
    assert (twins[twins[inner]] == inner).all()
    sides = directed_edges(triangulation.faces)
    assert (sides[inner] == sides[twins[inner]][:, ::-1]).all()
    assert triangulation.lengths.ravel()[inner] == pytest.approx(triangulation.lengths.ravel()[twins[inner]])


def assert_delaunay(triangulation: IntrinsicTriangulation) -> None:
    cotangent = cotangents(triangulation.lengths).ravel()
    inner = triangulation.inner_sides
    assert (cotangent[inner] + cotangent[triangulation.twins[inner]]).min() > -1e-9


@pytest.mark.parametrize("stretch", [2, 10, 100])
def test_in_the_plane_it_is_the_delaunay_triangulation(stretch):
    rng = np.random.default_rng(stretch)
    points = rng.uniform(size=300) + 1j * rng.uniform(size=300)
    before, stretched = planar(points), points.real * stretch + 1j * points.imag
    flat = np.stack([stretched.real, stretched.imag, 0 * stretched.real], axis=1)
    result = intrinsic_delaunay(intrinsic(TriangleMesh(flat, before.faces)))
    assert_well_formed(result)
    found = cotangent_laplacian(result.faces, result.lengths, 300).toarray()
    after = planar(stretched)
    expected = cotangent_laplacian(after.faces, after.edge_lengths, 300).toarray()
    # of a needle on the hull a length keeps few digits of the area
    ordinary = np.abs(expected) < 1e3
    assert np.abs(found - expected)[ordinary].max() < 1e-4
    assert ordinary.mean() > 0.999


@pytest.mark.parametrize("name", ["teeth/K04.obj", "faces_ict/ict_M_happy_level4.obj"])
def test_a_scan_keeps_its_vertices_its_angles_and_its_area(real_mesh, name):
    mesh = real_mesh(name)
    before = intrinsic(mesh)
    after = intrinsic_delaunay(before)
    assert_well_formed(after)
    assert_delaunay(after)
    assert (after.faces != before.faces).any()
    assert (after.twins < 0).sum() == (before.twins < 0).sum()
    assert angles(after) == pytest.approx(angles(before), abs=1e-6)
    # what u^T L u is for a coordinate may only fall (Rippa), never by much on a fine scan
    energy = [
        x @ cotangent_laplacian(t.faces, t.lengths, len(x)) @ x for t in (before, after) for x in [mesh.vertices[:, 0]]
    ]
    assert energy[1] < energy[0]


def test_angle_sums_of_the_start_are_those_of_the_surface(real_mesh):
    mesh = real_mesh("teeth/K04.obj")
    corner = corner_angles(mesh.vertices[mesh.faces])
    assert angles(intrinsic(mesh)) == pytest.approx(np.bincount(mesh.faces.ravel(), corner.ravel()))


def ladder(rungs: int) -> TriangleMesh:
    """A strip of squares cut in two: every inner edge joins two boundary vertices."""
    x = np.arange(rungs + 1)
    vertices = np.concatenate([np.stack([x, 0 * x, 0 * x], axis=1), np.stack([x, 0 * x + 1, 0 * x], axis=1)])
    a, b, c, d = x[:-1], x[1:], x[1:] + rungs + 1, x[:-1] + rungs + 1
    return TriangleMesh(vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]), "ladder")


@pytest.mark.parametrize("rungs", [1, 2, 9])
def test_no_edge_joins_two_boundary_vertices(rungs):
    mesh = ladder(rungs)
    start = intrinsic(mesh)
    boundary = topology(mesh).boundary_loops[0]
    result = without_chords(start, boundary)
    assert_well_formed(result)
    assert_delaunay(result)
    inner = directed_edges(result.faces)[result.inner_sides]
    assert not np.isin(inner, boundary).all(axis=1).any()
    added = angles(result)[len(mesh.vertices) :]
    assert len(added)
    assert added == pytest.approx(np.full(len(added), 2 * np.pi))
    assert angles(result)[: len(mesh.vertices)] == pytest.approx(angles(start))


def test_a_debugger_changes_nothing():
    """What is traced has more references than what is not."""
    mesh = ladder(3)
    boundary = topology(mesh).boundary_loops[0]
    sys.setprofile(lambda *_: None)
    try:
        traced = without_chords(intrinsic(mesh), boundary)
    finally:
        sys.setprofile(None)
    assert np.array_equal(traced.faces, without_chords(intrinsic(mesh), boundary).faces)
