"""How sure the dense map is of each point: the probability that it errs by less than `BOUND`.

A logistic model of what can be seen without the truth (`evidence`), fitted to pairs of surfaces whose correspondence is
known and checked on kinds of surface it was not fitted to: `python -m tests.bench.confidence`.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree
from scipy.special import expit

from ...flatten.sphere import Flat
from ...mobius import Mobius, SphereMobius
from ...surface.barycentric import interpolated
from ...surface.mesh import Floats, Integers, Places
from ...surface.statistics import weighted_median
from .agreement import descriptor_distance, log_stretch

BOUND = 0.02
"""Share of the source's bounding box diagonal: the confidence is the probability of a smaller error."""

MATCHED = 0.5
"""Confidence from which on a point counts as matched: more likely than not it errs by less than `BOUND`."""

DOUBTFUL = 0.5
"""Mean confidence up to which the whole map is doubted aloud."""

NEAR_RIM = 0.05
"""Length over which the influence of the source's boundaries fades, in roots of the source's area."""

COLUMNS = ("constant", "descriptors", "stretch", "near rim", "unmatched samples", "moved", "offset", "unfolded")

DENSE = np.array([4.586, -1.22, -4.349, 0.0, -7.783, 0.0, 0.0, 0.0])
"""Coefficients of the columns for maps that were bent: of 80 best maps and 18 rivals on 9 kinds of surface. On a kind
left out the mean confidence is 0.002 to 0.24 away from the share of points below `BOUND`, in bins of confidence 0.02 to
0.25: too low where one side alone has openings, too high on teeth. Columns with 0 say nothing beyond the others. The
maps have become better since (docs/accuracy.md): what decides between maps was measured by these."""

MOBIUS = np.array([2.891, -1.415, -4.458, 0.0, -4.952, 0.0, 0.0, 0.0])
"""The same for Möbius maps: 0.01 to 0.24 away, in bins 0.02 to 0.24."""


FITTED = 100
"""Source points of the maps that the coefficients were fitted to."""

SURE = 1.645
"""Standard errors up to which chance may reach: one-sided, 95 %."""


def unmatched_share(matched: float, count: int) -> float:
    """Return the share of `count` samples, of which `matched` matched, that were not, as it counts beside `FITTED`.

    A Möbius transformation has three parameters, so that three samples match whatever they are; and of fewer samples
    the share is known less well. Both count as unmatched as far as they exceed what they are for `FITTED`.
    """
    share = 1 - matched / count
    spread = SURE * np.sqrt(max(share * (1 - share), 0.0))
    return float(share + max(3 / count - 3 / FITTED + spread * (count**-0.5 - FITTED**-0.5), 0.0))


def probability(seen: Floats, *, bent: bool) -> Floats:
    """Return the probability, (q,), of an error below `BOUND` from evidence, (q, 8), for maps that were bent or not."""
    return expit(seen @ (DENSE if bent else MOBIUS))


def expected_error(confidence: Floats) -> Floats:
    """Return the mean error, (q,), of points of a confidence, (q,) in [0, 1], as a share of the source's diagonal.

    As if errors were distributed exponentially, of which the share `confidence` lies below `BOUND`; infinite at 0.
    On 44 pairs of 13 kinds of surface its mean was 0.4 to 7.6 times the true mean error, in the median 2.5 times.
    """
    with np.errstate(divide="ignore"):
        return -BOUND / np.log1p(-np.minimum(confidence, 1 - 1e-9))


def evidence(
    source: Flat,
    target: Flat,
    source_descriptors: Floats,
    target_descriptors: Floats,
    located: tuple[Integers, Floats],
    carried: Places,
    unmatched: float,
    bending: tuple[Mobius | SphereMobius, Floats, float] | None,
) -> Floats:
    """Return what speaks against a map at each target vertex in use, (q, 8), columns as in `COLUMNS`.

    The constant 1; the root mean square difference of the descriptors; the modulus of the log of the stretch, relative
    to its median; exp(-distance from the source's boundaries / `NEAR_RIM`); the share of the samples that the search
    did not match; how far from its Möbius image the vertex was bent, and how far above the source it stayed, in roots
    of the source's area; the share of all vertices that the unfolding moved (the last three are 0 where nothing was
    bent). Descriptors and stretch are cut off where they say no more.

    Parameters
    ----------
    source, target : Flat
    source_descriptors, target_descriptors : (n, d) float64
    located : (n_target,) int, (n_target, 3) float64
        The source's face, and where in it, of each target vertex.
    carried : (n_target,) complex128
        Where each goes in the source's disc.
    unmatched : float
        Share of the samples that the search did not match.
    bending : Mobius, (n_target,) float64 and float, or None
        What was bent, how far above the source each vertex stayed, and the share of them that the unfolding moved.
    """
    used = np.flatnonzero(target.mesh.used)
    face, barycentric = located[0][used], located[1][used]
    root = np.sqrt(source.mesh.area)
    distance = descriptor_distance(source, source_descriptors, target_descriptors[used], face, barycentric) / np.sqrt(
        source_descriptors.shape[1]
    )
    stretch = log_stretch(source, target, carried, face, barycentric, used)
    stretch -= weighted_median(stretch, target.mesh.vertex_areas[used])
    vertices, faces = source.mesh.vertices, source.mesh.faces
    places = interpolated(vertices, faces[face], barycentric)
    near = np.zeros(len(used))
    if source.loops:
        rim = vertices[np.concatenate(source.loops)]
        near = np.exp(-KDTree(rim).query(places, workers=-1 if len(places) > 1000 else 1)[0] / root / NEAR_RIM)
    moved, offset, unfolded = np.zeros(len(used)), np.zeros(len(used)), 0.0
    if bending is not None:
        mobius, above, unfolded = bending
        start = mobius.inverse()(target.places[used])
        there, weights = source.triangles.locate(start)
        moved = np.linalg.norm(interpolated(vertices, faces[there], weights) - places, axis=1) / root
        offset = above[used]
    return np.stack(
        [
            np.ones(len(used)),
            np.minimum(distance, 3),
            np.minimum(np.abs(stretch), 2),
            near,
            np.full(len(used), unmatched),
            moved,
            offset,
            np.full(len(used), unfolded),
        ],
        axis=1,
    )
