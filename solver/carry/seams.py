"""On which side of a seam a value is taken."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from ..surface.barycentric import interpolated, weighted
from ..surface.mesh import Booleans, Floats, Integers
from ..surface.nearest import nearest_in_triangle
from .charts import Charts

_REACH = 4.0
"""How much faster than at the two ends a value may change between two points of one side of a seam."""


def middles(place: Floats, known: Booleans, group: Integers) -> tuple[Floats, Integers]:
    """Return each group's anchor point, (g, 3), and the triangle whose centroid it is, (g,); -1: nothing is known."""
    area = np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1)
    # whole triangles first, then those of which some corners are known
    order = np.lexsort((area, known.sum(axis=1)))
    triangle = np.full(int(group.max()) + 1, -1)
    triangle[group[order]] = order
    triangle[triangle >= 0] = np.where(known[triangle].any(axis=1), triangle, -1)[triangle >= 0]
    share = known[triangle] / np.maximum(known[triangle].sum(axis=1, keepdims=True), 1)
    return weighted(place[triangle], share), triangle


def anchors_of(
    triangles: Integers, vertices: Floats, middle: Floats, rank: Integers, face: Integers
) -> tuple[Integers, Floats]:
    """Return the source triangle nearest to each group's middle, (g,), and the barycentric coordinates there, (g, 3).

    -1 and 0 for groups of which nothing is known.
    """
    groups = np.flatnonzero(rank >= 0)
    anchor, weights = np.full(len(middle), -1), np.zeros((len(middle), 3))
    anchor[groups], weights[groups] = nearest_triangles(vertices[triangles], middle[groups], face[rank[groups]])
    return anchor, weights


def nearest_triangles(corners: Floats, query: Floats, guesses: Integers) -> tuple[Integers, Floats]:
    """Return the triangle of (m, 3, 3) nearest to each query, (q,), and the barycentric coordinates, (q, 3), in it.

    Tried are the guesses, (q, h), -1 for none, and the triangles whose middles are nearest, up to twelve, until no
    further one can be nearer.
    """
    centre = corners.mean(axis=1)
    size = np.sqrt(((corners - centre[:, None]) ** 2).sum(axis=2).max())
    best, best_distance = np.full(len(query), -1), np.full(len(query), np.inf)
    best_weights = np.zeros((len(query), 3))

    def attempt(rows: Integers, triangle: Integers) -> None:
        weights = nearest_in_triangle(query[rows], corners[triangle])
        distance = np.linalg.norm(weighted(corners[triangle], weights) - query[rows], axis=1)
        nearer = distance < best_distance[rows]
        rows = rows[nearer]
        best[rows], best_distance[rows], best_weights[rows] = triangle[nearer], distance[nearer], weights[nearer]

    for k in range(guesses.shape[1]):
        rows = np.flatnonzero((guesses[:, k] >= 0) & (guesses[:, k] != best))
        attempt(rows, guesses[rows, k])
    open_rows = np.flatnonzero(best_distance > 1e-12 * size)
    tree = KDTree(centre) if len(open_rows) else None
    first = 0
    for count in (4, 12):
        if tree is None or len(open_rows) == 0 or first >= len(centre):
            break
        count = min(count, len(centre))
        away, near = (x.reshape(len(open_rows), count) for x in tree.query(query[open_rows], k=count))
        for k in range(first, count):
            # a triangle reaches no further from its middle than `size`
            can = best_distance[open_rows] > away[:, k] - size
            open_rows, away, near = open_rows[can], away[can], near[can]
            attempt(open_rows, near[:, k])
        first = count
    return best, best_weights


def on_side_of_anchor(
    charts: Charts,
    vertices: Floats,
    face: Integers,
    weights: Floats,
    place: Floats,
    anchor_face: Integers,
    anchor_value: Floats,
    anchor_place: Floats,
) -> Floats:
    """Return the values, (q, d), at located points, each on the side of the seams that its anchor lies on."""
    flat = charts.values.reshape(-1, charts.values.shape[2])
    wanted = charts.island[anchor_face]
    corner = _corners_on_side(charts, face, anchor_face, anchor_value)
    own = 3 * face[:, None] + np.arange(3)
    wedge = charts.wedge.ravel()
    right = ((corner >= 0) & (wedge[corner] == wedge[own])) | (weights == 0)
    at_home = right.all(axis=1) & (charts.island[face] == wanted)
    # beyond the seam, only what lies on it has a value of the anchor's side
    kept = np.where((corner >= 0) & (at_home[:, None] | charts.seam[charts.triangles[face]]), weights, 0.0)
    total = kept.sum(axis=1)
    found = at_home | (total > 1e-6)
    kept[~at_home] /= np.maximum(total, 1e-6)[~at_home, None]
    values = interpolated(flat, corner, kept)
    values[at_home] = interpolated(flat, own[at_home], weights[at_home])

    speed = np.maximum(_speed(charts, vertices, face), _speed(charts, vertices, anchor_face))
    gap = np.linalg.norm(values - anchor_value, axis=1)
    reach = _REACH * speed * np.linalg.norm(place - anchor_place, axis=1)
    beside_slit = at_home & (gap > reach) & (charts.island[face] == wanted)
    beside_slit &= ~charts.seam[charts.triangles[face]].any(axis=1)
    far = np.flatnonzero(~found | beside_slit)
    for label in np.unique(wanted[far]):
        rows = far[wanted[far] == label]
        members = np.flatnonzero(charts.island == label)
        corners = (3 * members[:, None] + np.arange(3)).ravel()
        corners = corners[np.unique(wedge[corners], return_index=True)[1]]
        where = vertices[charts.triangles.ravel()[corners]]
        tree = KDTree(where)
        # the first of the nearest that is on this side; of more of them only where none is
        for candidates in (16, 1024):
            k = min(candidates, len(corners))
            near = tree.query(place[rows], k=k)[1].reshape(len(rows), k)
            gap = np.linalg.norm(flat[corners[near]] - anchor_value[rows, None], axis=2)
            reach = _REACH * speed[rows, None] * np.linalg.norm(where[near] - anchor_place[rows, None], axis=2)
            within = gap <= reach
            first = np.where(within.any(axis=1), within.argmax(axis=1), gap.argmin(axis=1))
            values[rows] = flat[corners[near[np.arange(len(rows)), first]]]
            rows = rows[~within.any(axis=1)]
            if len(rows) == 0:
                break
    return values


def _corners_on_side(charts: Charts, face: Integers, anchor_face: Integers, anchor_value: Floats) -> Integers:
    """Return for each vertex of some triangles a corner of its wedge on the anchor's side, (q, 3); -1: there is none.

    Of several wedges in the anchor's island the one is taken that its triangle is in, then a neighbour of its triangle,
    then the one whose value is nearest.
    """
    flat = charts.values.reshape(-1, charts.values.shape[2])
    candidate, row = charts.wedges_at(charts.triangles[face].ravel())
    query = row // 3
    around = charts.neighbours[anchor_face]
    around = np.where(around < 0, anchor_face[:, None], around)
    wedge = charts.wedge.ravel()[candidate]
    in_anchor = (charts.wedge[anchor_face][query] == wedge[:, None]).any(axis=1)
    beside = (charts.wedge[around].reshape(len(face), 9)[query] == wedge[:, None]).any(axis=1)
    nearness = np.linalg.norm(flat[candidate] - anchor_value[query], axis=1)
    fits = in_anchor | (charts.island[candidate // 3] == charts.island[anchor_face][query])
    # np.lexsort sorts by its last key first
    order = np.lexsort((nearness, ~beside, ~in_anchor, ~fits, row))
    first = order[np.searchsorted(row[order], np.arange(3 * len(face)))]
    return np.where(fits[first], candidate[first], -1).reshape(-1, 3)


def _speed(charts: Charts, vertices: Floats, face: Integers) -> Floats:
    """Return how fast the value changes along the sides of triangles, (q,), at most."""
    sides = vertices[charts.triangles[face]]
    length = np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2)
    change = np.linalg.norm(charts.values[face] - np.roll(charts.values[face], 1, axis=1), axis=2)
    return np.divide(change, length, out=np.zeros_like(length), where=length > 0).max(axis=1)
