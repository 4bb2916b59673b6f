"""Sparse symmetric positive definite systems of meshes: SuperLU for small ones, nested dissection for large ones.

George, "Nested Dissection of a Regular Finite Element Mesh" (1973); Duff and Reid, "The Multifrontal Solution of
Indefinite Sparse Symmetric Linear Equations" (1983). The graph is cut in two again and again along short curves, level
sets of hop distances from far-apart vertices. What is left of a part once its inside is eliminated is a small dense
matrix, so that nearly all of the work is done by BLAS.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import numpy as np
from scipy.linalg import get_blas_funcs, get_lapack_funcs
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import splu

from .mesh import Floats, Integers

try:
    import threadpoolctl
except ImportError:  # the same to the last digits, and twice as slow
    threadpoolctl = None

LARGE = 180_000
"""Unknowns from which nested dissection is faster than SuperLU: of irregular meshes at 170,000 to 180,000 (it takes as
long or 1.4 times as long), of regular ones from 90,000 on (docs/flattening.md)."""

SMOOTHINGS = 5
"""Times that distances in edges are averaged over neighbours: 2 gain most of it, 10 to 40 cost what they gain."""

LEAF = 100
"""Parts of so many unknowns or fewer are eliminated as one dense block."""


def factorised(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return the solver, for (n,) and (n, k), of a sparse symmetric positive definite system."""
    return (superlu if matrix.indptr.size - 1 < LARGE else nested_dissection_cholesky)(matrix)


def superlu(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return the solver, for (n,) and (n, k), of a sparse symmetric positive definite system."""
    # columns one by one: the factors of surfaces are too sparse for SuperLU's panels to pay
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, relax=1, panel_size=1, options=options).solve


@dataclass(frozen=True, eq=False)
class _Front:
    """Columns start to stop of the factor: the inverse of its diagonal block, and the dense block at `rows` below."""

    start: int
    stop: int
    rows: Integers
    inverse: Floats
    below: Floats


def nested_dissection_cholesky(matrix: csc_array) -> Callable[[Floats], Floats]:
    """Return the solver, for (n,) and (n, k), of a sparse symmetric positive definite system.

    Raises
    ------
    ValueError
        The matrix is not positive definite.
    """
    n = matrix.indptr.size - 1
    part = nested_dissection(csr_array(matrix))
    depth = np.frexp(part)[1] - 1
    deepest = int(depth.max())
    # children before parents: by the end of a part's range of descendants, the deepest first
    below = deepest - depth
    key = ((((part + 1) << below) - 1) << 6) + below
    order = np.argsort(key, kind="stable")
    bounds = np.flatnonzero(np.diff(key[order], prepend=-1))
    place = np.empty(n, np.int32)
    place[order] = np.arange(n)
    entries = matrix.tocoo()
    row, column = place[entries.row], place[entries.col]
    lower = row >= column
    permuted = csc_array((entries.data[lower], (row[lower], column[lower])), shape=(n, n))
    with one_thread():
        fronts = _eliminated(permuted, part[order[bounds]], np.append(bounds, n))

    def solve(right: Floats) -> Floats:
        x = right[order].reshape(n, -1)
        with one_thread():
            for front in fronts:
                x[front.start : front.stop] = y = front.inverse @ x[front.start : front.stop]
                x[front.rows] -= front.below @ y
            for front in reversed(fronts):
                own = x[front.start : front.stop] - front.below.T @ x[front.rows]
                x[front.start : front.stop] = front.inverse.T @ own
        result = np.empty_like(x)
        result[order] = x
        return result.reshape(right.shape)

    return solve


def nested_dissection(graph: csr_array, leaf: int = LEAF) -> Integers:
    """Return the part of each vertex, (n,): a number in the binary tree where part p has the children 2 p and 2 p + 1.

    A vertex of an inner part separates the descendants on one side from those on the other: no edge joins them.
    """
    n = graph.indptr.size - 1
    coordinates = _hop_coordinates(graph)
    edges = graph.tocoo()
    first, second = edges.row[edges.row < edges.col], edges.col[edges.row < edges.col]
    part, member = np.ones(n, np.intp), np.arange(n)
    open_ = np.ones(n, bool)
    while True:
        member = member[open_[member]]
        member = member[np.argsort(part[member], kind="stable")]
        starts = np.flatnonzero(np.diff(part[member], prepend=0))
        sizes = np.diff(np.append(starts, len(member)))
        open_[member[np.repeat(sizes <= leaf, sizes)]] = False
        if not (sizes > leaf).any():
            return part
        member = member[np.repeat(sizes > leaf, sizes)]
        starts = np.flatnonzero(np.diff(part[member], prepend=0))
        sizes = np.diff(np.append(starts, len(member)))
        of_member = np.repeat(np.arange(len(sizes)), sizes)

        here = coordinates[:, member]
        width = np.maximum.reduceat(here, starts, axis=1) - np.minimum.reduceat(here, starts, axis=1)
        along = here[np.argmax(width, axis=0)[of_member], np.arange(len(member))]
        member = member[np.argsort(along + 2 * len(part) * of_member)]  # by group, then along
        right = np.arange(len(member)) - starts[of_member] >= sizes[of_member] // 2
        side = 2 * part
        side[member] += right

        inside = open_[first] & open_[second] & (part[first] == part[second])
        first, second = first[inside], second[inside]
        cut = side[first] != side[second]
        separator = np.where(side[first[cut]] % 2 == 1, first[cut], second[cut])
        open_[separator] = False
        part[open_] = side[open_]


def _hop_coordinates(graph: csr_array, count: int = 4) -> Floats:
    """Return distances in edges from far-apart vertices, (count, n), smoothed; a little of the next one breaks ties.

    Of an irregular mesh the level sets are ragged, and many vertices lie in each: curves through means over neighbours
    cross a quarter fewer edges, and the factors take two thirds to a third of the time.
    """
    nearest = _hops(graph, 0)
    coordinates = np.empty((count, len(nearest)))
    for k in range(count):
        coordinates[k] = _hops(graph, int(np.argmax(nearest)))
        nearest = coordinates[k].copy() if k == 0 else np.minimum(nearest, coordinates[k])
    pattern = csr_array((np.ones(graph.nnz), graph.indices, graph.indptr), shape=graph.shape)
    degree, smooth = np.diff(graph.indptr)[:, None], coordinates.T
    for _ in range(SMOOTHINGS):
        smooth = (pattern @ smooth) / degree
    return smooth.T + 1e-4 * np.roll(smooth.T, 1, axis=0)


def _hops(graph: csr_array, start: int) -> Floats:
    """Return the distance in edges of each vertex from one, (n,); n where there is no way."""
    n = graph.indptr.size - 1
    order, before = breadth_first_order(graph, start, directed=False)
    place = np.empty(n, np.intp)
    place[order] = np.arange(len(order))
    parent = place[before[order[1:]]]  # ascending: a hop ends where the parents are those that the last one found
    ends = [0, 1]
    while ends[-1] < len(order):
        ends.append(1 + int(np.searchsorted(parent, ends[-1])))
    hops = np.full(n, float(n))
    hops[order] = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    return hops


def one_thread() -> AbstractContextManager[object]:
    """Keep BLAS to one thread: on thousands of small blocks more of them mostly wait for each other."""
    return nullcontext() if threadpoolctl is None else threadpoolctl.threadpool_limits(1, "blas")


def _eliminated(matrix: csc_array, parts: Integers, bounds: Integers) -> list[_Front]:
    """Factorise the permuted matrix, of which the lower triangle is given, part after part."""
    starts, indices, data = matrix.indptr, matrix.indices.astype(np.intp), matrix.data
    place, work = np.empty(len(starts) - 1, np.intp), np.empty((3, 0))
    waiting: dict[int, list[tuple[Integers, Floats]]] = {p: [] for p in parts.tolist()}
    fronts: list[_Front] = []
    # all from scipy: numpy brings another BLAS, and the idle threads of the one would spin on the other's cores
    potrf, trtri = get_lapack_funcs(("potrf", "trtri"), dtype=np.float64)
    trmm, syrk = get_blas_funcs(("trmm", "syrk"), dtype=np.float64)
    for p, start, stop in zip(parts.tolist(), bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        span = slice(starts[start], starts[stop])
        row, value = indices[span], data[span]
        column = np.repeat(np.arange(stop - start), np.diff(starts[start : stop + 1]))
        children = waiting.pop(p)
        reached = np.concatenate([row, *(rows for rows, _ in children)])
        reached = reached[reached >= stop]
        place[reached] = np.arange(len(reached))
        rows = np.sort(reached[place[reached] == np.arange(len(reached))])  # each once
        k = stop - start
        place[start:stop] = np.arange(k)
        place[rows] = k + np.arange(len(rows))
        size = k + len(rows)
        if size**2 > work.shape[1]:
            work = np.empty((3, 2 * size**2))  # memory that is there already: fresh pages cost more than the sums
        front = work[0, : size**2].reshape(size, size).T  # its lower triangle counts
        front[:] = 0
        for nth, (child_rows, update) in enumerate(children):
            at = place[child_rows]
            spread, sums = (w[: len(at) * size].reshape(len(at), size) for w in work[1:])
            spread[:] = 0
            spread[:, at] = update.T
            if nth:
                np.take(front.T, at, axis=0, out=sums, mode="clip")
                spread += sums
            front.T[at] = spread  # row by row: element by element takes five times as long
        front[place[row], column] += value.astype(np.float64, copy=False)
        factor, failed = potrf(front[:k, :k], lower=1, clean=1)
        if failed:
            raise ValueError("the matrix is not positive definite")
        inverse, _ = trtri(factor, lower=1)
        below = front[k:, :k]
        if len(rows):
            below = trmm(1.0, inverse, below, side=1, lower=1, trans_a=1)
            parent = p // 2
            while parent not in waiting:  # a part whose inside has no edge across needs no separator
                parent //= 2
            waiting[parent].append((rows, syrk(-1.0, below, 1.0, front[k:, k:], lower=1)))
        fronts.append(_Front(start, stop, rows, inverse, below))
    return fronts
