import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, csr_array, eye_array
from surfaces import planar, rings

from solver.surface.cholesky import factorised, nested_dissection, nested_dissection_cholesky
from solver.surface.laplacian import laplacian


def system(count: int) -> csc_array:
    """The Laplacian of a disc, its rim held."""
    points = rings(count, jitter=0.3)
    inner = np.abs(points) < 1 - 1e-9
    return csc_array(laplacian(planar(points))[inner][:, inner])


def test_no_edge_joins_the_two_sides_of_a_part():
    graph = csr_array(system(60))
    part = nested_dissection(graph, leaf=40)
    edges = graph.tocoo()
    one, other = part[edges.row], part[edges.col]
    # of two joined parts one is an ancestor of the other: the same number but for its last binary digits
    depth, depth_other = np.frexp(one)[1], np.frexp(other)[1]
    common = np.minimum(depth, depth_other)
    assert (one >> (depth - common) == other >> (depth_other - common)).all()
    leaves = np.bincount(part)[2 ** (part.max().item().bit_length() - 1) :]
    assert leaves.max() <= 40
    assert (part == 1).sum() < 4 * np.sqrt(graph.shape[0])


@pytest.mark.parametrize("count", [2, 5, 30, 80])
def test_it_solves_as_superlu_does(count):
    matrix = system(count)
    right = np.random.default_rng(0).standard_normal((matrix.shape[0], 2))
    solve = nested_dissection_cholesky(matrix)
    assert np.abs(matrix @ solve(right) - right).max() < 1e-10
    assert solve(right[:, 0]) == pytest.approx(factorised(matrix)(right[:, 0]), rel=1e-9, abs=1e-9)


def test_a_system_in_separate_pieces():
    matrix = csc_array(block_diag([system(20), eye_array(500), system(12)]))
    right = np.ones(matrix.shape[0])
    assert np.abs(matrix @ nested_dissection_cholesky(matrix)(right) - right).max() < 1e-10


def test_an_indefinite_matrix_is_refused():
    matrix = system(10)
    with pytest.raises(ValueError, match="not positive definite"):
        nested_dissection_cholesky(csc_array(matrix - 100 * eye_array(matrix.shape[0])))
