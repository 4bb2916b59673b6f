import numpy as np
import pytest
from scans import bumps, posed, remeshed, shuffled
from surfaces import spherical_cap

from solver import TriangleMesh
from solver.descriptors import diffused_mean_curvature, standardised


def test_a_sphere_has_the_curvature_of_its_radius():
    """1/R everywhere, times the root of the area; away from the boundary, which diffusion draws in."""
    mesh, truth = spherical_cap(40, 1.5)
    sphere = TriangleMesh(3 * mesh.vertices, mesh.faces)
    curvature = diffused_mean_curvature(sphere, (1e-4,))[:, 0]
    inside = np.abs(truth) < 0.8
    assert curvature[inside] == pytest.approx(np.sqrt(sphere.area) / 3, rel=0.03)


def test_inside_out_the_sign_turns():
    mesh, _ = spherical_cap(10, 1.0)
    out = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    assert diffused_mean_curvature(out) == pytest.approx(-diffused_mean_curvature(mesh), abs=1e-9)


def test_a_plane_has_none():
    mesh = bumps(300, seed=0)
    plane = TriangleMesh(mesh.vertices * [1, 1, 0], mesh.faces)
    inside = np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.5
    assert np.abs(diffused_mean_curvature(plane)[inside]).max() < 1e-6


def test_pose_scale_and_order_do_not_matter():
    mesh = bumps(500, seed=3)
    own = diffused_mean_curvature(mesh)
    assert diffused_mean_curvature(posed(mesh, 1)) == pytest.approx(own, abs=1e-8)
    mixed, vertex = shuffled(mesh, 2)
    assert diffused_mean_curvature(mixed) == pytest.approx(own[vertex], abs=1e-8)


def test_triangulation_hardly_matters():
    mesh = bumps(3000, seed=3)
    other, vertex = remeshed(mesh, 0.6, 4)
    here = standardised(diffused_mean_curvature(mesh), mesh.vertex_areas)[vertex]
    there = standardised(diffused_mean_curvature(other), other.vertex_areas)
    inside = np.hypot(*other.vertices[:, :2].T) < 0.9
    assert np.sqrt(((here - there)[inside] ** 2).mean(axis=0)).max() < 0.25


def test_loose_vertices_have_none():
    mesh = bumps(300, seed=3)
    loose = TriangleMesh(np.vstack([mesh.vertices, [[5, 5, 5]]]), mesh.faces)
    result = diffused_mean_curvature(loose)
    assert (result[-1] == 0).all()
    assert result[:-1] == pytest.approx(diffused_mean_curvature(mesh))


def test_standardised_by_weight():
    rng = np.random.default_rng(0)
    values, weights = rng.normal(3, 5, (200, 2)), rng.random(200)
    result = standardised(values, weights)
    assert np.average(result, axis=0, weights=weights) == pytest.approx(0, abs=1e-12)
    assert np.average(result**2, axis=0, weights=weights) == pytest.approx(1)
    assert (standardised(np.ones((5, 1)), np.ones(5)) == 0).all()
