"""Meshes of several parts: what is carried to one comes from its counterpart, however near other parts lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..surface.mesh import Floats, Integers
from .correspond import Correspondence
from .fill import without


def drawn_apart(correspondence: Correspondence, source_vertices: Floats, target_triangles: Integers) -> Floats:
    """Return source vertices, (n_source, 3), with the parts moved away from each other, each as a whole.

    What is looked for nearby (seams, faces, edges) is then found in the same part. Parts that have a vertex in common,
    or whose counterparts have, stay where they are beside each other.

    Parameters
    ----------
    correspondence : Correspondence
    source_vertices : (n_source, 3) float64
    target_triangles : (mt, 3) int
    """
    part = correspondence.source_part
    if part is None or part.max(initial=0) < 1:
        return source_vertices
    count = int(part.max()) + 1
    found = correspondence.face
    at = np.where(found >= 0, part[correspondence.source_triangles[found, 0]], -1)
    corners = np.concatenate([part[correspondence.source_triangles], at[target_triangles]])
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]]])
    sides = sides[(sides >= 0).all(axis=1) & (sides[:, 0] != sides[:, 1])]
    graph = coo_array((np.ones(len(sides)), tuple(sides.T)), shape=(count, count))
    group = connected_components(graph, directed=False)[1]
    group -= group[0]  # the main part stays where it is
    step = 2 * float(np.linalg.norm(np.ptp(source_vertices[part >= 0], axis=0)))
    result = source_vertices.copy()
    result[:, 0] += step * np.where(part >= 0, group[part], 0)
    return result


def without_riders(correspondence: Correspondence) -> Correspondence:
    """Return the correspondence without those vertices that only ride along with another part's surface."""
    if correspondence.leader is None:
        return correspondence
    return replace(without(correspondence, correspondence.leader >= 0), leader=None)


def pieces(triangles: Integers, size: int) -> Integers:
    """Return a number for each vertex, (size,), that those share which hang together; -1 in no triangle."""
    links = (triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())
    label = connected_components(coo_array((np.ones(len(links[0])), links), shape=(size, size)), directed=False)[1]
    used = np.zeros(size, bool)
    used[triangles] = True
    return np.where(used, np.unique(np.where(used, label, label.max() + 1), return_inverse=True)[1].reshape(-1), -1)
