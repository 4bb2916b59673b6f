"""How sure the dense map is of each point: the probability that it errs by less than `BOUND`.

A logistic model of what can be seen without the truth (`evidence`), fitted to pairs of surfaces whose correspondence is
known and checked on kinds of surface it was not fitted to: `python -m tests.bench.confidence`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree
from scipy.special import expit

from .agreement import descriptor_distance, log_stretch, weighted_median
from .locate import TriangulatedDisc
from .mesh import Floats

if TYPE_CHECKING:
    from .alignment import Alignment

BOUND = 0.02
"""Share of the source's bounding box diagonal: the confidence is the probability of a smaller error."""

NEAR_RIM = 0.05
"""Length over which the influence of the source's boundaries fades, in roots of the source's area."""

COLUMNS = ("constant", "descriptors", "stretch", "near rim", "unmatched samples", "moved", "offset")

DENSE = np.array([4.586, -1.22, -4.349, 0.0, -7.783, 0.0, 0.0])
"""Coefficients of the columns for maps that were bent: of 80 best maps and 18 rivals on 9 kinds of surface. On a kind
left out the mean confidence is 0.002 to 0.24 away from the share of points below `BOUND`, in bins of confidence 0.02 to
0.25: too low where one side alone has openings, too high on teeth. Columns with 0 say nothing beyond the others."""

MOBIUS = np.array([2.891, -1.415, -4.458, 0.0, -4.952, 0.0, 0.0])
"""The same for Möbius maps: 0.01 to 0.24 away, in bins 0.02 to 0.24."""


def confidence(alignment: Alignment) -> Floats:
    """Return the probability, (n_target,), that each target vertex errs by less than `BOUND`.

    0 at vertices in no face, and at those that were found to have no counterpart.
    """
    result = np.zeros(len(alignment.target.disc))
    if alignment.overlap is not None:
        result[alignment.overlap.target.vertices] = confidence(alignment.overlap.alignment)
    else:
        used = np.isfinite(alignment.target.disc.real)
        result[used] = expit(evidence(alignment) @ (MOBIUS if alignment.bending is None else DENSE))
    if alignment.counterpart is not None:
        result[~alignment.counterpart] = 0
    return result


def evidence(alignment: Alignment) -> Floats:
    """Return what speaks against the map at each target vertex in use, (q, 7), columns as in `COLUMNS`.

    The constant 1; the root mean square difference of the descriptors; the modulus of the log of the stretch, relative
    to its median; exp(-distance from the source's boundaries / `NEAR_RIM`); the share of the samples that the search
    did not match; how far from its Möbius image the vertex was bent, and how far above the source it stayed, in roots
    of the source's area (both 0 where nothing was bent). All but the last two are cut off where they say no more.
    """
    source, target = alignment.source, alignment.target
    used = np.flatnonzero(np.isfinite(target.disc.real))
    face, barycentric = alignment.located[0][used], alignment.located[1][used]
    root = np.sqrt(source.mesh.area)
    distance = descriptor_distance(
        source, alignment.source_descriptors, alignment.target_descriptors[used], face, barycentric
    ) / np.sqrt(alignment.source_descriptors.shape[1])
    stretch = log_stretch(source, target, alignment.carried, face, barycentric, used)
    stretch -= weighted_median(stretch, target.mesh.vertex_areas[used])
    vertices, faces = source.mesh.vertices, source.mesh.faces
    places = np.einsum("qk,qkd->qd", barycentric, vertices[faces[face]])
    rim = vertices[np.concatenate([source.boundary, *source.holes])]
    near = np.exp(-KDTree(rim).query(places)[0] / root / NEAR_RIM)
    moved, offset = np.zeros(len(used)), np.zeros(len(used))
    if alignment.bending is not None:
        start = alignment.mobius.inverse()(target.disc[used])
        there, weights = TriangulatedDisc.of(source.disc, faces).locate(start)
        moved = np.linalg.norm(np.einsum("qk,qkd->qd", weights, vertices[faces[there]]) - places, axis=1) / root
        offset = alignment.bending.offset[used]
    unmatched = 1 - alignment.value / len(alignment.source_samples)
    return np.stack(
        [
            np.ones(len(used)),
            np.minimum(distance, 3),
            np.minimum(np.abs(stretch), 2),
            near,
            np.full(len(used), unmatched),
            moved,
            offset,
        ],
        axis=1,
    )
