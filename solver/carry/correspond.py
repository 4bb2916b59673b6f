"""The dense map: which point of the source each vertex of the target corresponds to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ..align.alignment import Alignment
from ..flatten.sphere import Flat
from ..surface.mesh import Booleans, Floats, Integers, Places
from ..surface.tidy import Cleaned


@dataclass(frozen=True, eq=False)
class Correspondence:
    """For each target vertex a point of the source surface.

    Attributes
    ----------
    face : (n,) int
        Triangle of the source; -1 where there is none (a target vertex in no face).
    barycentric : (n, 3) float64
        Coordinates in that triangle: non-negative, sum 1; 0 where face is -1.
    matched : (n,) bool
        Whether it is more likely right than not: confidence at least 1/2.
    confidence : (n,) float64
        Probability that the point is off by less than 2 % of the source's bounding box diagonal, as `confidence.BOUND`
        says; 0 where there is no counterpart.
    source_triangles : (m, 3) int
        Vertex indices of the source's triangles.
    source_size : int
        Number of source vertices.
    """

    face: Integers
    barycentric: Floats
    matched: Booleans
    confidence: Floats
    source_triangles: Integers
    source_size: int

    def matrix(self) -> csr_array:
        """Return the sparse (n_target, n_source) matrix that carries values at source vertices; rows sum to 1, or 0."""
        known = self.face >= 0
        columns = self.source_triangles[self.face[known]].ravel()
        ends = np.concatenate([[0], 3 * np.cumsum(known)])
        return csr_array((self.barycentric[known].ravel(), columns, ends), shape=(len(self.face), self.source_size))


def correspond(alignment: Alignment) -> Correspondence:
    """Carry every target vertex through the discs into the source.

    The vertex's place in the target's disc is taken back by the inverse transformation and located in the source's. One
    that comes to lie in an opening of the source takes the nearest point of its rim, with a confidence of 0. Faces and
    vertices are those of the meshes as they came, whatever was put in order for the computation.
    """
    source, target = alignment.source, alignment.target
    used = np.flatnonzero(target.mesh.used)
    face, barycentric = alignment.located
    confidence = alignment.confidence.copy()
    confidence[used[in_openings(source, alignment.carried[used], face[used], barycentric[used])]] = 0
    triangles, size = source.mesh.faces, len(source.places)
    if (tidy := alignment.source_cleaned) is not None and tidy.changes:
        triangles, size = tidy.original_faces, tidy.size
        face, barycentric = _in_own_triangles(face, barycentric, tidy)
    if (tidy := alignment.target_cleaned) is not None and tidy.changes:
        face, barycentric = tidy.at_vertices(face, -1), tidy.at_vertices(barycentric, 0)
        confidence = tidy.at_vertices(confidence, 0)
    return Correspondence(
        face=face,
        barycentric=barycentric,
        matched=confidence >= 0.5,
        confidence=confidence,
        source_triangles=triangles,
        source_size=size,
    )


def _in_own_triangles(face: Integers, barycentric: Floats, tidy: Cleaned) -> tuple[Integers, Floats]:
    """Return places on a source that was put in order as places on the source as it came."""
    located = face >= 0
    barycentric = barycentric.copy()
    turned = located & tidy.reversed[face]
    barycentric[turned] = barycentric[turned][:, [0, 2, 1]]
    return np.where(located, tidy.faces[face], -1), barycentric


def in_openings(flattening: Flat, places: Places, face: Integers, barycentric: Floats) -> Booleans:
    """Return which points of the disc, (q,), lie in an opening: their nearest point, as located, is on its rim."""
    if not flattening.holes:
        return np.zeros(len(face), bool)
    on_rim = np.zeros(len(flattening.places), bool)
    for loop in flattening.holes:
        on_rim[loop] = True
    corners = flattening.mesh.faces[face]
    nearest = flattening.domain.mean(flattening.places, corners, barycentric)
    return (on_rim[corners] | (barycentric == 0)).all(axis=1) & (np.abs(nearest - places) > 1e-9)
