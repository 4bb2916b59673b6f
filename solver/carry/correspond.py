"""The dense map: which point of the source each vertex of the target corresponds to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ..align.result.alignment import Alignment
from ..align.result.confidence import MATCHED
from ..align.result.whole import Whole
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
    part : (n,) int or None
        The part of the target that each vertex is in, the main one 0; -1 in no face. None: there is one part.
    source_part : (n_source,) int or None
        The same of the source.
    leader : (n,) int or None
        Vertices of parts without a counterpart ride along: they have the point of the surface next to them, which moves
        them and no more, and here the vertex of that surface in whose frame they are moved; -1 at others.
    """

    face: Integers
    barycentric: Floats
    matched: Booleans
    confidence: Floats
    source_triangles: Integers
    source_size: int
    part: Integers | None = None
    source_part: Integers | None = None
    leader: Integers | None = None

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
    found = Correspondence(
        face=face,
        barycentric=barycentric,
        matched=confidence >= MATCHED,
        confidence=confidence,
        source_triangles=triangles,
        source_size=size,
    )
    return found if alignment.whole is None else _of_all_parts(found, alignment.whole)


def _of_all_parts(main: Correspondence, whole: Whole) -> Correspondence:
    """Return a correspondence of the main parts with those of the others."""
    others = whole.face >= 0
    confidence = np.where(others, whole.confidence, main.confidence)
    return replace(
        main,
        face=np.where(others, whole.face, main.face),
        barycentric=np.where(others[:, None], whole.barycentric, main.barycentric),
        matched=confidence >= MATCHED,
        confidence=confidence,
        part=whole.target.of_vertex,
        source_part=whole.source.of_vertex,
        leader=whole.leader,
    )


def _in_own_triangles(face: Integers, barycentric: Floats, tidy: Cleaned) -> tuple[Integers, Floats]:
    """Return places on a source that was put in order as places on the source as it came."""
    face, barycentric = _beside_missing(face, barycentric.copy(), tidy)
    located = face >= 0
    turned = located & tidy.reversed[face]
    barycentric[turned] = barycentric[turned][:, [0, 2, 1]]
    return np.where(located, tidy.faces[face], -1), barycentric


def _beside_missing(face: Integers, barycentric: Floats, tidy: Cleaned) -> tuple[Integers, Floats]:
    """Return places on the source, of those in a face that the source as it came lacks the nearest on its edge."""
    lost = np.flatnonzero((face >= 0) & (tidy.faces[face] < 0))
    if not lost.size:
        return face, barycentric
    face, mesh, row = face.copy(), tidy.mesh, np.arange(len(lost))
    corner = np.argmin(barycentric[lost], axis=1)
    twin = mesh.twins[3 * face[lost] + corner]
    ends = mesh.faces[face[lost], (corner + 1) % 3]
    share = np.stack([barycentric[lost, (corner + step) % 3] for step in (1, 2)], axis=1)
    share /= share.sum(axis=1, keepdims=True)
    there, side = np.divmod(twin, 3)
    other = np.zeros((len(lost), 3))
    # the twin runs the other way: its second end is where this side begins
    first = mesh.faces[there, (side + 2) % 3] == ends
    other[row, (side + 2) % 3] = np.where(first, share[:, 0], share[:, 1])
    other[row, (side + 1) % 3] = np.where(first, share[:, 1], share[:, 0])
    face[lost], barycentric[lost] = there, other
    return face, barycentric


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
