"""Diffusion on large meshes without a factorisation of all of it: conjugate gradients, preconditioned on two grids.

What a step of diffusion leaves is smooth, so that a grid of a tenth of the vertices nearly carries it, and a sweep over
the mesh itself before and after puts right what that grid does not see (a two-level method; the grid by smoothed
aggregation: Vanek, Mandel and Brezina, "Algebraic Multigrid by Smoothed Aggregation", 1996). Only the small grid is
factorised. All the rest is products of sparse matrices, which other threads need not wait for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from .cholesky import factorised
from .mesh import Floats, Integers
from .sampling import independent

MOST_STEPS = 40
"""Steps after which a factorisation takes over: 7 to 9 are the rule."""

SMOOTHING, SWEEP = 2 / 3, 0.8
"""Damping of the steps of Jacobi's method that smooth the small grid's functions, and before and after it: the first
is 4/3 over the largest eigenvalue, at most 2; of 0.6 and 0.8 the second takes a step less."""


class TwoGrids:
    """A mesh's diffusion, (M + t L) x = right, for any t.

    Parameters
    ----------
    stiffness : (n, n) sparse
        L: positive semidefinite, its rows sum to 0, no weight is negative.
    masses : (n,) float64
        The diagonal of M, positive.
    """

    def __init__(self, stiffness: csr_array, masses: Floats) -> None:
        self.stiffness, self.masses = stiffness, masses
        self._up = _smooth_aggregates(stiffness)
        self._down = csr_array(self._up.T)
        self._small_stiffness = self._down @ (stiffness @ self._up)
        self._small_masses = self._down @ (diags_array(masses) @ self._up)

    def solved(self, time: float, right: Floats, enough: Callable[[Floats, Floats], bool]) -> Floats:
        """Return x, (n, k).

        Parameters
        ----------
        time : float
            t, in units of area.
        right : (n, k) float64
        enough : callable
            Told x, (n, k), and about what it errs by, (n, k), at each step; returns whether that is little enough. May
            raise to end it.
        """
        matrix = csr_array(diags_array(self.masses) + time * self.stiffness)
        coarse = factorised(csc_array(self._small_masses + time * self._small_stiffness))
        sweep = SWEEP / matrix.diagonal()[:, None]

        def precondition(residual: Floats) -> Floats:
            y = sweep * residual
            y += self._up @ coarse(self._down @ (residual - matrix @ y))
            y += sweep * (residual - matrix @ y)
            return y

        x = precondition(right)
        residual = right - matrix @ x
        error = precondition(residual)
        direction, size = error.copy(), _dot(residual, error)
        for _ in range(MOST_STEPS):
            image = matrix @ direction
            step = size / np.maximum(_dot(direction, image), np.finfo(float).tiny)
            x += step * direction
            residual -= step * image
            error = precondition(residual)
            if enough(x, error):
                return x + error
            before, size = size, _dot(residual, error)
            direction *= size / np.maximum(before, np.finfo(float).tiny)
            direction += error
        return factorised(csc_array(matrix))(right)


def _dot(one: Floats, other: Floats) -> Floats:
    """Return the dot product of each column, (k,), of two (n, k)."""
    return np.einsum("ij,ij->j", one, other)


def _smooth_aggregates(stiffness: csr_array) -> csr_array:
    """Return how functions on the small grid, (c,), are functions on the mesh, (n, c): a smoothed step on each part."""
    region = _aggregates(stiffness)
    n = len(region)
    steps = csr_array((np.ones(n), region, np.arange(n + 1)), shape=(n, int(region.max()) + 1))
    damped = SMOOTHING / np.maximum(stiffness.diagonal(), np.finfo(float).tiny)
    return csr_array(steps - diags_array(damped) @ (stiffness @ steps))


def _aggregates(stiffness: csr_array) -> Integers:
    """Return the part, (n,), that each vertex belongs to: about ten neighbours around vertices three edges apart."""
    pattern = csr_array((np.ones(stiffness.nnz, np.int32), stiffness.indices, stiffness.indptr), shape=stiffness.shape)
    n = len(stiffness.indptr) - 1
    twice = csr_array(pattern @ pattern).tocoo()
    near = twice.row < twice.col
    pairs = np.stack([twice.row[near], twice.col[near]], axis=1)
    roots = np.flatnonzero(independent(pairs, np.random.default_rng(0).permutation(n)))
    region = np.full(n, -1)
    region[roots] = np.arange(len(roots))
    links = stiffness.tocoo()
    while (region < 0).any():
        joining = np.flatnonzero((region[links.row] < 0) & (region[links.col] >= 0))
        # of several writes to one vertex the last one stays: that of the strongest link
        joining = joining[np.argsort(-links.data[joining], kind="stable")]
        region[links.row[joining]] = region[links.col[joining]]
    return region
