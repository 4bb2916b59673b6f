"""Boundary edges that coincide in pairs: cuts along UV seams and hard edges, halves of a mirror, loose triangles.

Files that keep one normal and one UV per vertex repeat vertices, and the surface comes cut open. Two sides are joined
where they lie in one place, run against each other and the faces go on from each other. They are left apart where shape
keys move them apart (closed lips), and where the faces would fold back onto each other (the two sides of cloth).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from .gluing import Glue, glue_of, starts, stops
from .mesh import Floats, Integers, TriangleMesh
from .spikes import LONG

TOUCHING = 1e-6
"""Distance, in diagonals, up to which boundary vertices lie in one place; at most a hundredth of the edges there."""

ENOUGH = 0.15
"""Share of the smaller part's boundary along which parts of other orientation must touch to be joined."""

FOLD = 0.97
"""Cosine of the angle between two faces at an edge, 14 degrees, below which one lies on the other."""


def coinciding(positions: Floats, faces: Integers, glue: Glue, keys: Floats | None = None) -> Glue:
    """Return the pairs of boundary sides that are one edge.

    Parameters
    ----------
    positions : (n, 3) float64
    faces : (m, 3) int
    glue : Glue
        The sides that are joined already.
    keys : (n, d) float64, optional
        Where else the vertices can go, as by shape keys: what does not stay together there is apart.
    """
    sides = glue.single_sides(len(faces))
    start, stop = starts(faces)[sides], stops(faces)[sides]
    place = _places(positions, start, stop, keys)
    start, stop = place[start], place[stop]
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    order = np.lexsort((high, low))
    order = order[low[order] != high[order]]
    new = np.flatnonzero(np.append(True, (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)))
    count = np.diff(np.append(new, len(order)))
    first = new[count == 2]
    one, other = order[first], order[first + 1]
    # more than two in one place, as of double-sided cloth in loose triangles: each with each
    crowds = [order[a : a + k] for a, k in zip(new[count > 2], count[count > 2], strict=True) if k <= 16]
    pairs = [np.stack(np.triu_indices(len(crowd), 1)) for crowd in crowds]
    one = np.concatenate([one, *[crowd[p[0]] for crowd, p in zip(crowds, pairs, strict=True)]])
    other = np.concatenate([other, *[crowd[p[1]] for crowd, p in zip(crowds, pairs, strict=True)]])
    if not one.size:
        return Glue(sides[:0], sides[:0], np.zeros(0, bool))
    opposed = start[one] == stop[other]
    fold = _fold(positions, faces, sides[one], sides[other])
    fit = np.flatnonzero(fold < FOLD)
    fit = fit[np.lexsort((fold[fit], ~opposed[fit]))]
    fit = fit[_greedily(one[fit], other[fit], len(sides))]
    one, other, opposed = sides[one[fit]], sides[other[fit]], opposed[fit]
    found = Glue(one[opposed], other[opposed], np.ones(int(opposed.sum()), bool))
    if opposed.all():
        return found
    whole = glue.with_others(found)
    length = np.linalg.norm(positions[stops(faces)] - positions[starts(faces)], axis=1)
    length = np.minimum(length, LONG * np.median(length))  # or a single spike would be most of a boundary
    return found.with_others(_turned_parts(whole, length, one[~opposed], other[~opposed]))


def first_of_place(mesh: TriangleMesh, keys: Floats | None = None) -> Integers:
    """Return the first of the vertices, (n,), that each one is one with where the surface is cut open; see above.

    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> first_of_place(TriangleMesh(np.array(corners), np.array([[0, 1, 2], [3, 4, 5]]))).tolist()
    [0, 1, 2, 1, 4, 2]
    """
    faces, size = mesh.faces, len(mesh.vertices)
    found = coinciding(mesh.vertices, faces, glue_of(faces, mesh.twins), keys)
    start, stop = starts(faces), stops(faces)
    left, right = found.left, found.right
    one, other = np.where(found.opposed, stop[right], start[right]), np.where(found.opposed, start[right], stop[right])
    links = np.concatenate([start[left], stop[left]]), np.concatenate([one, other])
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(size, size))
    label = connected_components(graph, directed=False)[1]
    first = np.full(label.max(initial=-1) + 1, size)
    np.minimum.at(first, label, np.arange(size))
    return first[label]


def _places(positions: Floats, start: Integers, stop: Integers, keys: Floats | None) -> Integers:
    """Return a number, (n,), that boundary vertices in one place share."""
    rim = np.unique(np.concatenate([start, stop]))
    points = positions[rim]
    size = float(np.linalg.norm(np.ptp(positions[np.unique(rim)], axis=0))) if len(rim) else 0.0
    length = np.linalg.norm(positions[start] - positions[stop], axis=1)
    shortest = np.full(len(positions), np.inf)
    np.minimum.at(shortest, start, length)
    np.minimum.at(shortest, stop, length)
    near = KDTree(points).query_pairs(TOUCHING * size, output_type="ndarray") if len(rim) > 1 else np.empty((0, 2), int)
    i, j = near[:, 0], near[:, 1]
    apart = np.linalg.norm(points[i] - points[j], axis=1)
    together = apart <= 0.01 * np.minimum(shortest[rim[i]], shortest[rim[j]])
    if keys is not None and keys.size:
        moved = np.abs(keys[rim[i]] - keys[rim[j]]).max(axis=1)
        together &= moved <= TOUCHING * max(size, float(np.ptp(keys)))
    links = i[together], j[together]
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(len(rim), len(rim)))
    label = connected_components(graph, directed=False)[1]
    place = np.arange(len(positions)) + len(rim)
    place[rim] = label
    return place


def _fold(positions: Floats, faces: Integers, one: Integers, other: Integers) -> Floats:
    """Return the cosine between the faces of two sides in one place, seen along it: 1 where one lies on the other."""
    along = positions[stops(faces)[one]] - positions[starts(faces)[one]]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    across = []
    for side in (one, other):
        away = positions[faces.ravel()[side]] - positions[starts(faces)[side]]
        away -= (away * along).sum(axis=1, keepdims=True) * along
        across.append(away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny))
    return (across[0] * across[1]).sum(axis=1)


def _greedily(one: Integers, other: Integers, count: int) -> Integers:
    """Return the rows of pairs, best first, that have no side in common with a pair taken before."""
    uses = np.bincount(np.concatenate([one, other]), minlength=count)
    taken = np.zeros(count, bool)
    rows = []
    alone = (uses[one] == 1) & (uses[other] == 1)
    for row in np.flatnonzero(~alone).tolist():
        a, b = one[row], other[row]
        if not (taken[a] or taken[b]):
            taken[a] = taken[b] = True
            rows.append(row)
    return np.concatenate([np.flatnonzero(alone), np.array(rows, np.intp)])


def _turned_parts(glue: Glue, length: Floats, one: Integers, other: Integers) -> Glue:
    """Return those pairs of sides that run the same way because a whole part is turned round.

    None inside a part, and none where parts touch along little of their boundaries, as where both sides of cloth have
    holes. `length`, (3 m,), is that of each side.
    """
    face_count = len(length) // 3
    part = glue.parts(face_count)
    left, right = part[one // 3], part[other // 3]
    rim = glue.single_sides(face_count)
    around = np.bincount(part[rim // 3], length[rim], minlength=int(part.max()) + 1)
    _, pair = np.unique(np.minimum(left, right) * len(around) + np.maximum(left, right), return_inverse=True)
    touching = np.bincount(pair, length[one])[pair]
    between = (left != right) & (touching > ENOUGH * np.minimum(around[left], around[right]))
    one, other, left, right = one[between], other[between], left[between], right[between]
    count = int(part.max()) + 1
    # parts in both orientations: joining must not make a surface with one side
    links = np.concatenate([left, left + count]), np.concatenate([right + count, right])
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    two_sided = label[left] != label[left + count]
    return Glue(one[two_sided], other[two_sided], np.zeros(int(two_sided.sum()), bool))
