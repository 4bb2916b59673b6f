import numpy as np
import pytest
from scans import bumps, posed
from surfaces import planar, rings, spherical_cap

from solver import TriangleMesh
from solver.surface.fairing import ROUGH, faired, noise, roughness


def noisy(mesh: TriangleMesh, amount: float, seed: int = 0) -> TriangleMesh:
    shift = np.random.default_rng(seed).normal(scale=amount * mesh.diagonal, size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + shift, mesh.faces, mesh.name)


@pytest.mark.parametrize("mesh", [bumps(2000, seed=1), spherical_cap(20, 1.2)[0], planar(rings(15, jitter=0.3))])
def test_smooth_surfaces_stay_the_same_to_the_last_bit(mesh) -> None:
    assert roughness(mesh) < ROUGH
    assert faired(mesh) is mesh


@pytest.mark.parametrize("amount", [0.001, 0.004])
def test_the_deviation_of_noise_is_measured(amount: float) -> None:
    rough = noisy(bumps(4000, seed=2), amount)
    for seed, mesh in enumerate((rough, posed(rough, 1))):
        assert noise(mesh.vertices, faired(mesh)) == pytest.approx(amount * mesh.diagonal, rel=0.1), seed


def test_without_noise_hardly_any_is_measured() -> None:
    """What is left comes from triangles of different sizes on a bent surface."""
    clean = bumps(4000, seed=2)
    assert noise(clean.vertices, clean) < 2e-4 * clean.diagonal
    corner = TriangleMesh(np.eye(3), np.array([[0, 1, 2]]))
    assert noise(corner.vertices, corner) == 0


@pytest.mark.parametrize("amount", [0.002, 0.004])
def test_noise_is_found_and_most_of_it_taken_off(amount: float) -> None:
    clean = bumps(4000, seed=1)
    rough = noisy(clean, amount)
    assert roughness(rough) > ROUGH
    fair = faired(rough)
    assert (fair.faces == clean.faces).all()

    def off(mesh: TriangleMesh) -> float:
        """Mean angle between the triangles' normals and the true ones."""
        one, other = (x.face_vectors / np.linalg.norm(x.face_vectors, axis=1, keepdims=True) for x in (mesh, clean))
        return float(np.arccos(np.clip((one * other).sum(axis=1), -1, 1)).mean())

    assert roughness(fair) < 0.2 * roughness(rough)
    assert off(fair) < 0.5 * off(rough)


def test_the_boundary_and_loose_vertices_stay() -> None:
    clean = bumps(2000, seed=3)
    loose = TriangleMesh(np.concatenate([clean.vertices, [[5.0, 5, 5]]]), clean.faces)
    rough = noisy(loose, 0.003)
    rim = np.unique(rough.edges[np.bincount(rough.edge_of_side) == 1])
    fair = faired(rough)
    assert fair is not rough
    assert (fair.vertices[rim] == rough.vertices[rim]).all()
    assert (fair.vertices[-1] == rough.vertices[-1]).all()


def test_pose_and_scale_do_not_matter() -> None:
    rough = noisy(bumps(1500, seed=2), 0.003)
    there = posed(rough, 4)
    assert roughness(there) == pytest.approx(roughness(rough), rel=1e-9)
    again = posed(faired(rough), 4).vertices
    assert np.abs(faired(there).vertices - again).max() < 1e-9 * there.diagonal


def test_a_crease_is_no_roughness() -> None:
    """A roof of two planes: its ridge stays as sharp as it is."""
    flat = planar(rings(25, jitter=0.2))
    x, y = flat.vertices[:, :2].T
    roof = TriangleMesh(np.column_stack([x, y, -1.5 * np.abs(x)]), flat.faces)
    fair = faired(roof)
    assert np.abs(fair.vertices - roof.vertices).max() < 0.05


def test_a_coarse_mesh_is_no_noise() -> None:
    coarse = bumps(120, seed=0)
    rough = noisy(coarse, 0.02)
    assert roughness(rough) > ROUGH
    assert faired(rough) is rough


def test_a_single_triangle_is_left_alone() -> None:
    one = TriangleMesh(np.eye(3), np.array([[0, 1, 2]]))
    assert faired(one) is one
