"""Where the target lies on the source already: the nearest point is the truth there, the map only says near what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..align.result.confidence import BOUND
from ..surface.barycentric import interpolated
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.topology import topology
from ..surface.walking import faces_beyond, nearest_from
from .correspond import Correspondence

ON_SURFACE = 1e-3
"""Of the source's diagonal: as far off the source are vertices of a target that lies on it. Scans of one thing, brought
together, are off by their noise; a map of surfaces in one place errs by as much."""

NEARLY_ALL = 0.95
"""Of the target's vertices: where fewer lie on the source, as with another expression, the two are not in one place."""


def settled(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """Return a correspondence with the nearest points where the target lies on the source and the map agrees.

    A place agrees that is off the nearest point by at most half of what counts as right. From there it spreads: a
    vertex beside one that is settled lies where one comes from that one's place, going over the source.

    Parameters
    ----------
    found : Correspondence
    source : TriangleMesh
        In the space that both are in.
    target : TriangleMesh
        There too.
    """
    located = np.flatnonzero(found.face >= 0)
    if len(located) == 0:
        return found
    points = SurfacePoints(source, topology(source).boundary_loops, 0.01 * source.diagonal)
    own, normals = target.vertices[located], target.vertex_normals()[located]
    face, place = points.nearest_point(own, normals)
    there = interpolated(source.vertices, source.faces[face], place)
    given = interpolated(source.vertices, source.faces[found.face[located]], found.barycentric[located])
    on_it = np.linalg.norm(there - own, axis=1) <= ON_SURFACE * source.diagonal
    agrees = np.linalg.norm(there - given, axis=1) <= BOUND / 2 * source.diagonal
    if (on_it & agrees).mean() < NEARLY_ALL:
        return found
    chosen = located[on_it & agrees]
    faces, barycentric = found.face.copy(), found.barycentric.copy()
    faces[chosen], barycentric[chosen] = face[on_it & agrees], place[on_it & agrees]
    open_ones = np.zeros(len(faces), bool)
    open_ones[located[~(on_it & agrees)]] = True
    _spread(faces, barycentric, open_ones, source, target)
    return replace(found, face=faces, barycentric=barycentric)


def _spread(faces: Integers, barycentric: Floats, left: Booleans, source: TriangleMesh, target: TriangleMesh) -> None:
    """Settle vertices that are left, (n,), from those beside them, in place, as long as there are any on the source."""
    beyond, normals = faces_beyond(source), (source.vertex_normals(), target.vertex_normals())
    new = ~left & (faces >= 0)
    edges = np.concatenate([target.edges, target.edges[:, ::-1]])
    edges = edges[left[edges[:, 1]]]
    while left.any() and new.any():
        pairs = edges[new[edges[:, 0]] & left[edges[:, 1]]]
        vertex, first = np.unique(pairs[:, 1], return_index=True)
        start = faces[pairs[first, 0]]
        face, place, off = nearest_from(source, beyond, start[:, None], target.vertices[vertex])
        there = interpolated(normals[0], source.faces[face], place)
        good = (off <= ON_SURFACE * source.diagonal) & ((there * normals[1][vertex]).sum(axis=1) > 0)
        faces[vertex[good]], barycentric[vertex[good]] = face[good], place[good]
        left[vertex[good]] = False
        new = np.zeros(len(faces), bool)
        new[vertex[good]] = True
