"""The continuous Procrustes distance, against Lambert's map of the sphere and what a distance must be."""

import numpy as np
import pytest
from scans import bumps, mirrored, posed
from scipy.integrate import quad
from surfaces import planar, rings, spherical_cap

from solver import TriangleMesh, flatten
from solver.collection.distance import EvenFlow, continuous_procrustes
from solver.collection.procrustes import centroid_size, generalised
from solver.surface.superimposing import superimposing


def by_symmetry(alpha: float) -> float:
    """Distance of a cap of polar angle alpha from a flat disc: Lambert's map preserves areas, and the axes coincide."""
    cap, disc = 1 / np.sqrt(2 * np.pi * (1 - np.cos(alpha))), 1 / np.sqrt(np.pi)

    def polar(share: float) -> float:
        return np.arccos(1 - share * (1 - np.cos(alpha)))

    middle = quad(lambda share: cap * np.cos(polar(share)), 0, 1)[0]

    def square(share: float) -> float:
        out = disc * np.sqrt(share) - cap * np.sin(polar(share))
        return out**2 + (cap * np.cos(polar(share)) - middle) ** 2

    return float(np.sqrt(quad(square, 0, 1)[0]))


@pytest.mark.parametrize("alpha", [np.pi / 4, np.pi / 2])
@pytest.mark.parametrize("turned", [False, True])
def test_a_cap_and_a_flat_disc(alpha: float, turned: bool) -> None:
    cap, disc = flatten(spherical_cap(24, alpha, 0.25)[0]), flatten(planar(rings(26, 0.25, seed=5)))
    source, target = (cap, disc) if turned else (disc, cap)
    flow = EvenFlow(source)
    # by the conformal map, which does not preserve areas
    found = continuous_procrustes(flow, target, flow.surface.triangles.locate(target.disc), mirrored=False)
    assert found == pytest.approx(by_symmetry(alpha), rel=0.02)


def test_the_flow_evens_areas_out() -> None:
    cap, disc = flatten(spherical_cap(30, 2.0, 0.25)[0]), flatten(planar(rings(30, 0.25, seed=3)))
    flow = EvenFlow(disc)
    face, weights = flow.surface.triangles.locate(cap.disc)
    moved = np.abs(flow.evened(cap.disc, face, weights, cap.mesh.vertex_areas / cap.mesh.area))
    share = cap.mesh.vertex_areas / cap.mesh.area
    for radius in (0.3, 0.5, 0.8):  # of a flat disc, the square of the radius is the share of the area
        assert share[moved < radius].sum() == pytest.approx(radius**2, abs=0.02)
        assert abs(share[np.abs(cap.disc) < radius].sum() - radius**2) > 0.03  # as it was not before


def test_the_same_surface_in_another_pose_is_at_no_distance() -> None:
    mesh = bumps(1500, seed=3)
    source, target = flatten(mesh), flatten(posed(mesh, 4))
    flow = EvenFlow(source)
    located = flow.surface.triangles.locate(source.disc)
    assert continuous_procrustes(flow, target, located, mirrored=False) < 0.003
    image = flatten(mirrored(mesh))
    assert continuous_procrustes(flow, image, located, mirrored=True) < 0.003
    assert continuous_procrustes(flow, image, located, mirrored=False) > 0.02


def test_the_mean_of_one_shape_in_many_poses_is_that_shape() -> None:
    rng = np.random.default_rng(2)
    shape, weights = rng.normal(size=(40, 3)), rng.uniform(0.1, 1, 40)
    meshes = [posed(TriangleMesh(shape, [[0, 1, 2]]), seed).vertices for seed in range(5)]
    meshes[3] = meshes[3] * [1, -1, 1]
    shapes = np.stack(meshes)
    mean, poses = generalised(shapes, weights, [False, False, False, True, False])
    sizes = [centroid_size(each, weights) for each in shapes]
    assert centroid_size(mean, weights) == pytest.approx(np.mean(sizes))
    for pose, each in zip(poses, shapes, strict=True):
        np.testing.assert_allclose(pose(each), mean, atol=1e-9)
    back = superimposing(mean, shapes[0], weights, scaled=True)
    np.testing.assert_allclose(back.turn, np.eye(3), atol=1e-9)
