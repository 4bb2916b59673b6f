"""Values for the part of a surface that has none, from the part that has: the nearest, or a harmonic fill between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from ..surface.cholesky import factorised
from ..surface.laplacian import cotangents, mollified_lengths
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from .correspond import Correspondence


def nearest_known(mesh: TriangleMesh, known: Booleans) -> Integers:
    """Return the known vertex that is nearest to each vertex, (n,), along edges; itself where known.

    In parts without any known vertex it is the nearest in space; -1 everywhere if none is known.
    """
    result = np.where(known, np.arange(len(known)), -1)
    unknown = np.flatnonzero(~known)
    if len(unknown) == 0 or not known.any():
        return result
    low, high = mesh.edges[(~known[mesh.edges]).any(axis=1)].T
    length = np.linalg.norm(mesh.vertices[low] - mesh.vertices[high], axis=1)
    length = np.maximum(length, np.finfo(float).tiny)  # a zero would be no edge to the graph
    # only edges at unknown vertices are there, so that the rim of the known part is all that is searched from
    graph = csr_array(coo_array((length, (low, high)), shape=(len(known), len(known))))
    rim = np.intersect1d(np.flatnonzero(known), np.concatenate([low, high]))
    if len(rim):
        source = dijkstra(graph, directed=False, indices=rim, return_predecessors=True, min_only=True)[2]
        result[unknown] = np.where(source[unknown] >= 0, source[unknown], -1)
    apart = unknown[result[unknown] < 0]
    if len(apart):
        there = np.flatnonzero(known)
        result[apart] = there[KDTree(mesh.vertices[there]).query(mesh.vertices[apart])[1]]
    return result


def without(correspondence: Correspondence, excluded: Booleans) -> Correspondence:
    """Return the correspondence without a counterpart for the excluded target vertices, (n_target,)."""
    return replace(
        correspondence,
        face=np.where(excluded, -1, correspondence.face),
        barycentric=np.where(excluded[:, None], 0.0, correspondence.barycentric),
        matched=correspondence.matched & ~excluded,
        confidence=np.where(excluded, 0.0, correspondence.confidence),
    )


def with_nearest(correspondence: Correspondence, nearest: Integers) -> Correspondence:
    """Return the correspondence in which each target vertex has the counterpart of another, (n_target,); -1: none."""
    found = nearest >= 0
    return replace(
        correspondence,
        face=np.where(found, correspondence.face[nearest], -1),
        barycentric=np.where(found[:, None], correspondence.barycentric[nearest], 0.0),
    )


@dataclass(frozen=True, eq=False)
class HarmonicFill:
    """Harmonic functions on the unknown part of a surface, with the values of its known rim.

    Every filled value is a mean, with weights of at least 0, of known ones: none leaves their range, and weights that
    sum to 1 still do.

    Attributes
    ----------
    reached : (n,) bool
        Known vertices, and unknown ones that hang together with known ones.
    """

    reached: Booleans
    _inside: Integers
    _rim: csr_array
    _solve: Callable[[Floats], Floats] | None

    @staticmethod
    def of(mesh: TriangleMesh, known: Booleans) -> HarmonicFill:
        """Prepare the fill of a mesh from its known vertices, (n,).

        Cotangent weights of the edges (Pinkall and Polthier 1993) that are negative, at obtuse angles, count as 1e-6 of
        the mean weight, for the maximum principle.
        """
        count = len(known)
        half = 0.5 * cotangents(mollified_lengths(mesh.edge_lengths)).ravel()
        weight = np.bincount(mesh.edge_of_side, half, len(mesh.edges))
        weight = np.maximum(weight, 1e-6 * np.abs(weight).mean())
        low, high = mesh.edges.T
        graph = csr_array(coo_array((weight, (low, high)), shape=(count, count)))
        part = connected_components(graph, directed=False)[1]
        reached = (np.bincount(part, known) > 0)[part]
        inside = np.flatnonzero(reached & ~known)
        graph = csr_array(graph + graph.T)[inside]
        total = graph.sum(axis=1)
        own = coo_array((total, (np.arange(len(inside)), np.arange(len(inside)))), shape=(len(inside), len(inside)))
        solve = factorised(csc_array(own - graph[:, inside])) if len(inside) else None
        return HarmonicFill(reached, inside, csr_array(graph @ _only(known)), solve)

    def __call__(self, values: Floats) -> Floats:
        """Return values, (n, ...), with the unknown ones filled; those that are not reached stay."""
        result = np.array(values, dtype=np.float64)
        if self._solve is not None:
            flat = result.reshape(len(result), -1)
            flat[self._inside] = self._solve(self._rim @ flat)
        return result


def _only(chosen: Booleans) -> csr_array:
    """Return the diagonal matrix, (n, n), that keeps the chosen rows."""
    rows = np.flatnonzero(chosen)
    return csr_array((np.ones(len(rows)), (rows, rows)), shape=(len(chosen), len(chosen)))
