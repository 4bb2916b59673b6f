import numpy as np
import pytest
from scans import bumps, posed, remeshed, shuffled
from surfaces import planar, rings, spherical_cap

from solver import TriangleMesh
from solver.surface.descriptors import DIFFUSION_TIMES, diffused_curvatures
from solver.surface.statistics import standardised


def test_a_sphere_has_the_curvatures_of_its_radius():
    """1/R everywhere, times the root of the area; away from the boundary, which diffusion draws in."""
    mesh, truth = spherical_cap(40, 1.5)
    sphere = TriangleMesh(3 * mesh.vertices, mesh.faces)
    mean, gauss = diffused_curvatures(sphere, (1e-4,)).T
    inside = np.abs(truth) < 0.8
    assert mean[inside] == pytest.approx(np.sqrt(sphere.area) / 3, rel=0.03)
    assert gauss == pytest.approx(np.sqrt(sphere.area) / 3, rel=0.03)  # up to the boundary


def test_a_saddle_has_negative_gauss_curvature():
    flat = planar(rings(20))
    x, y = flat.vertices[:, :2].T
    saddle = TriangleMesh(np.column_stack([x, y, 0.5 * (x**2 - y**2)]), flat.faces)
    mean, gauss = diffused_curvatures(saddle, (1e-3,))[0]  # the middle: principal curvatures 1 and -1
    assert mean == pytest.approx(0, abs=0.02)
    assert gauss == pytest.approx(-np.sqrt(saddle.area), rel=0.05)


def test_inside_out_the_mean_curvature_turns_its_sign():
    mesh, _ = spherical_cap(10, 1.0)
    out = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    sign = np.repeat([-1, 1], len(DIFFUSION_TIMES))
    assert diffused_curvatures(out) == pytest.approx(sign * diffused_curvatures(mesh), abs=1e-9)


def test_a_plane_has_none():
    mesh = bumps(300, seed=0)
    plane = TriangleMesh(mesh.vertices * [1, 1, 0], mesh.faces)
    inside = np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.5
    assert np.abs(diffused_curvatures(plane)[inside]).max() < 1e-6


def test_bending_leaves_the_gauss_curvature():
    """A catenoid bends into a helicoid without stretch, a plane into a cylinder."""
    flat = planar(rings(30))
    u, v = flat.vertices[:, :2].T
    catenoid = np.column_stack([np.cosh(u) * np.cos(v), np.cosh(u) * np.sin(v), u])
    helicoid = np.column_stack([np.sinh(u) * np.cos(v), np.sinh(u) * np.sin(v), v])
    here, there = (diffused_curvatures(TriangleMesh(x, flat.faces))[:, 4:] for x in (catenoid, helicoid))
    assert there == pytest.approx(here, abs=0.05)
    assert here[0] == pytest.approx(-np.sqrt(TriangleMesh(catenoid, flat.faces).area), rel=0.15)
    cylinder = TriangleMesh(np.column_stack([np.sin(u), v, np.cos(u)]), flat.faces)
    mean, gauss = diffused_curvatures(cylinder, (1e-3,))[0]
    assert gauss == pytest.approx(0, abs=0.1)
    assert abs(mean) == pytest.approx(np.sqrt(cylinder.area) / 2, rel=0.05)


def test_pose_scale_and_order_do_not_matter():
    mesh = bumps(500, seed=3)
    own = diffused_curvatures(mesh)
    assert diffused_curvatures(posed(mesh, 1)) == pytest.approx(own, abs=1e-6)
    mixed, vertex = shuffled(mesh, 2)
    assert diffused_curvatures(mixed) == pytest.approx(own[vertex], abs=1e-6)


def test_triangulation_hardly_matters():
    mesh = bumps(3000, seed=3)
    other, vertex = remeshed(mesh, 0.6, 4)
    here = standardised(diffused_curvatures(mesh), mesh.vertex_areas)[vertex]
    there = standardised(diffused_curvatures(other), other.vertex_areas)
    inside = np.hypot(*other.vertices[:, :2].T) < 0.9
    assert np.sqrt(((here - there)[inside] ** 2).mean(axis=0)).max() < 0.25


def test_loose_vertices_have_none():
    mesh = bumps(300, seed=3)
    loose = TriangleMesh(np.vstack([mesh.vertices, [[5, 5, 5]]]), mesh.faces)
    result = diffused_curvatures(loose)
    assert (result[-1] == 0).all()
    assert result[:-1] == pytest.approx(diffused_curvatures(mesh))


def test_standardised_by_weight():
    rng = np.random.default_rng(0)
    values, weights = rng.normal(3, 5, (200, 2)), rng.random(200)
    result = standardised(values, weights)
    assert np.average(result, axis=0, weights=weights) == pytest.approx(0, abs=1e-12)
    assert np.average(result**2, axis=0, weights=weights) == pytest.approx(1)
    assert (standardised(np.ones((5, 1)), np.ones(5)) == 0).all()
