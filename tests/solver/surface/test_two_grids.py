import numpy as np
import pytest
from scans import bumps
from scipy.sparse import block_diag, csc_array, csr_array, diags_array
from surfaces import planar, rings

from solver import TriangleMesh
from solver.surface import descriptors, two_grids
from solver.surface.cholesky import factorised
from solver.surface.descriptors import DIFFUSION_TIMES, diffused_curvatures
from solver.surface.intrinsic_delaunay import IntrinsicTriangulation, intrinsic_delaunay, non_negative_laplacian
from solver.surface.laplacian import mollified_lengths
from solver.surface.mesh import Floats
from solver.surface.two_grids import TwoGrids


def system(mesh: TriangleMesh) -> tuple[csr_array, Floats]:
    """The weights and masses of a mesh's intrinsic Delaunay triangulation."""
    sides = mollified_lengths(mesh.edge_lengths)
    surface = intrinsic_delaunay(IntrinsicTriangulation(mesh.faces, sides, mesh.twins, len(mesh.vertices)))
    return non_negative_laplacian(surface), surface.vertex_areas


def exact(stiffness: csr_array, masses: Floats, time: float, right: Floats) -> Floats:
    return factorised(csc_array(diags_array(masses) + time * stiffness))(right)


def until(share: float):
    return lambda x, error: bool(np.linalg.norm(error) <= share * np.linalg.norm(x))


@pytest.mark.parametrize("squeezed", [1.0, 0.02])  # needles: neighbours across are tied 50 times as strongly
@pytest.mark.parametrize("time", [*DIFFUSION_TIMES, 1e3])
def test_it_comes_as_near_to_a_factorisation_as_it_says(time: float, squeezed: float):
    mesh = planar(rings(30, jitter=0.3))
    mesh = TriangleMesh(mesh.vertices * [1, squeezed, 1], mesh.faces)
    stiffness, masses = system(mesh)
    right = masses[:, None] * np.random.default_rng(0).standard_normal((len(masses), 3))
    found = TwoGrids(stiffness, masses).solved(time * mesh.area, right, until(1e-6))
    truth = exact(stiffness, masses, time * mesh.area, right)
    assert np.linalg.norm(found - truth) < 1e-5 * np.linalg.norm(truth)


def test_pieces_and_single_vertices_diffuse_by_themselves():
    stiffness, masses = system(planar(rings(8)))
    both = csr_array(block_diag([stiffness, csr_array((1, 1)), stiffness]))
    weights = np.concatenate([masses, [1.0], masses])
    right = weights[:, None] * np.random.default_rng(1).standard_normal((len(weights), 2))
    found = TwoGrids(both, weights).solved(0.1, right, until(1e-9))
    assert found == pytest.approx(exact(both, weights, 0.1, right), rel=1e-6, abs=1e-8)
    assert found[len(masses)] == pytest.approx(right[len(masses)], rel=1e-9)


def test_what_does_not_settle_is_factorised(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(two_grids, "MOST_STEPS", 2)
    stiffness, masses = system(planar(rings(10)))
    right = masses[:, None] * np.random.default_rng(2).standard_normal((len(masses), 2))
    found = TwoGrids(stiffness, masses).solved(0.1, right, lambda *_: False)
    assert (found == exact(stiffness, masses, 0.1, right)).all()


def test_large_meshes_have_the_descriptors_of_small_ones(monkeypatch: pytest.MonkeyPatch):
    """Bit for bit the same each time, and nearer to those of a factorisation than another triangulation's are."""
    mesh = bumps(3000, seed=3)
    plain = diffused_curvatures(mesh)
    monkeypatch.setattr(descriptors, "LARGE", 1)
    told: list[float] = []
    found = diffused_curvatures(mesh, progress=told.append)
    share = mesh.vertex_areas / mesh.area
    spread = np.sqrt(share @ (plain - share @ plain) ** 2)
    assert (np.sqrt(share @ (found - plain) ** 2) < 0.01 * spread).all()
    assert (diffused_curvatures(TriangleMesh(mesh.vertices, mesh.faces)) == found).all()
    assert len(told) > 3 * len(DIFFUSION_TIMES)
    assert told == sorted(told)


def test_it_ends_when_it_is_told_to(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(descriptors, "LARGE", 1)
    told: list[float] = []

    def stop(share: float) -> None:
        told.append(share)
        if len(told) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diffused_curvatures(bumps(1000, seed=4), progress=stop)
    assert len(told) == 5
