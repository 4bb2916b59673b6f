"""Where the target lies on the source already: the nearest point is the truth there, the map only says near what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..align.confidence import BOUND
from ..surface.mesh import TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.topology import topology
from .correspond import Correspondence

ON_SURFACE = 1e-3
"""Of the source's diagonal: as far off the source are vertices of a target that lies on it. Scans of one thing, brought
together, are off by their noise; a map of surfaces in one place errs by as much."""

NEARLY_ALL = 0.95
"""Of the target's vertices: where fewer lie on the source, as with another expression, the two are not in one place."""


def settled(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """Return a correspondence with the nearest points where the target lies on the source and the map agrees.

    A place agrees that is off the nearest point by at most half of what counts as right.

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
    there = np.einsum("qk,qkd->qd", place, source.vertices[source.faces[face]])
    given = np.einsum("qk,qkd->qd", found.barycentric[located], source.vertices[source.faces[found.face[located]]])
    on_it = np.linalg.norm(there - own, axis=1) <= ON_SURFACE * source.diagonal
    agrees = np.linalg.norm(there - given, axis=1) <= BOUND / 2 * source.diagonal
    if (on_it & agrees).mean() < NEARLY_ALL:
        return found
    chosen = located[on_it & agrees]
    faces, barycentric = found.face.copy(), found.barycentric.copy()
    faces[chosen], barycentric[chosen] = face[on_it & agrees], place[on_it & agrees]
    return replace(found, face=faces, barycentric=barycentric)
