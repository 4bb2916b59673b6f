"""The dense map: which point of the source each vertex of the target corresponds to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from .align import Alignment
from .distortion import log_conformal_factor
from .flatten import Flattening
from .locate import TriangulatedDisc
from .mesh import Booleans, Complexes, Floats, Integers


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
        Whether the surfaces agree there: confidence at least 1/2.
    confidence : (n,) float64
        In [0, 1]: how well the descriptors agree and how little the map stretches.
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
        has = np.flatnonzero(self.face >= 0)
        rows = np.repeat(has, 3)
        columns = self.source_triangles[self.face[has]].ravel()
        return csr_array((self.barycentric[has].ravel(), (rows, columns)), shape=(len(self.face), self.source_size))


def correspond(alignment: Alignment) -> Correspondence:
    """Carry every target vertex through the discs into the source.

    The vertex's place in the target's disc is taken back by the inverse transformation and located in the source's. One
    that comes to lie in an opening of the source takes the nearest point of its rim, with a confidence of 0.
    """
    source, target = alignment.source, alignment.target
    size = len(target.disc)
    used = np.flatnonzero(np.isfinite(target.disc.real))
    disc = TriangulatedDisc.of(source.disc, source.mesh.faces)
    face = np.full(size, -1)
    barycentric = np.zeros((size, 3))
    places = alignment.carried[used]
    face[used], barycentric[used] = disc.locate(places)
    confidence = np.zeros(size)
    confidence[used] = _confidence(alignment, face[used], barycentric[used], used)
    confidence[used[in_openings(source, places, face[used], barycentric[used])]] = 0
    return Correspondence(
        face=face,
        barycentric=barycentric,
        matched=confidence >= 0.5,
        confidence=confidence,
        source_triangles=source.mesh.faces,
        source_size=len(source.disc),
    )


def in_openings(flattening: Flattening, places: Complexes, face: Integers, barycentric: Floats) -> Booleans:
    """Return which points of the disc, (q,), lie in an opening: their nearest point, as located, is on its rim."""
    on_rim = np.zeros(len(flattening.disc), bool)
    for loop in flattening.holes:
        on_rim[loop] = True
    corners = flattening.mesh.faces[face]
    nearest = (flattening.disc[corners] * barycentric).sum(axis=1)
    return (on_rim[corners] | (barycentric == 0)).all(axis=1) & (np.abs(nearest - places) > 1e-9)


def _confidence(alignment: Alignment, face: Integers, barycentric: Floats, used: Integers) -> Floats:
    """Return the agreement of descriptors and of local scale, in [0, 1], at target vertices `used`."""
    corners = alignment.source.mesh.faces[face]
    there = np.einsum("qk,qkd->qd", barycentric, alignment.source_descriptors[corners])
    difference = there - alignment.target_descriptors[used]
    # two independent descriptors differ by a variance of 2 per component; half the confidence is lost at that distance
    agreement = np.exp2(-(difference**2).mean(axis=1) / 2)
    stretch = _log_stretch(alignment, corners, barycentric, used)
    return agreement * np.exp2(-((stretch / np.log(3)) ** 2))


def _log_stretch(alignment: Alignment, corners: Integers, barycentric: Floats, used: Integers) -> Floats:
    """Return the log of the length ratio of the map at target vertices, relative to its median, (q,)."""
    source, target = alignment.source, alignment.target
    source_factor = log_conformal_factor(source.mesh, source.disc)
    carried_factor = log_conformal_factor(target.mesh, alignment.carried)[used]
    log_ratio = np.einsum("qk,qk->q", barycentric, source_factor[corners]) - carried_factor
    return log_ratio - np.median(log_ratio)
