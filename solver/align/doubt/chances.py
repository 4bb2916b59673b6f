"""How much of a target a map may make sure at most, before it is bent: what the samples promise, and what a draft does.

The confidence (`confidence.probability`) of bent maps hangs most on the share of the samples that do not match, which
is there before anything is drafted. A map that cannot come near the one that there is need not be bent to be lost.
"""

from __future__ import annotations

import numpy as np

from ...bend.bend import Draft
from ...surface.mesh import Floats, TriangleMesh
from ...surface.statistics import weighted_median
from ..maps.dense import PARTIAL
from ..result.agreement import descriptor_distance
from ..result.alignment import Alignment
from ..result.confidence import COLUMNS, probability, unmatched_share
from ..result.overlap import shared_nodes

UNFORESEEN = 2.5
"""Factor by which more of the target may be sure of a bent map than its samples promise: what both surfaces show is cut
out and searched anew. Of 95 bent maps of 8 kinds of surface at most 2.46, of a face that lacks 30 %; where nothing is
missing 1.2."""

UNFORESEEN_BY_DRAFT = 4.0
"""The same for what a draft by few vertices lets expect: at most 3.7, and 1.05 where nothing is missing."""


def promised(samples: float, count: int) -> float:
    """Return the confidence, in [0, 1], of a map of which so many of `count` samples match, if all else is right."""
    return float(probability(_columns(np.ones(1), unmatched=unmatched_share(samples, count)), bent=True)[0])


def may_reach(samples: float, count: int, sure: float) -> bool:
    """Return whether a map of which so many of `count` samples match may make that share of the target sure."""
    return UNFORESEEN * promised(samples, count) >= sure


def draft_may_reach(found: Alignment, draft: Draft, sure: float) -> bool:
    """Return whether a map may make that share of the target sure, by a draft of it."""
    return UNFORESEEN_BY_DRAFT * expected(found, draft) >= sure


def expected(found: Alignment, draft: Draft) -> float:
    """Return the share of the target, in [0, 1], that would be sure if a draft were the map, asked at its nodes."""
    nodes = TriangleMesh(draft.now, draft.flat.faces)
    shared = shared_nodes(draft, found.source, found.target)
    face, barycentric = draft.onto.nearest_point(draft.now, nodes.vertex_normals())
    own = found.target_descriptors[draft.few.nodes]
    distance = descriptor_distance(found.source, found.source_descriptors, own, face, barycentric)
    areas = draft.flat.vertex_areas
    missing = 1 - areas @ shared / areas.sum()
    tiny = np.finfo(float).tiny
    stretch = np.log(np.maximum(nodes.vertex_areas, tiny) / np.maximum(areas, tiny)) / 2
    seen = _columns(
        np.ones(len(areas)),
        descriptors=np.minimum(distance / np.sqrt(own.shape[1]), 3),
        stretch=np.minimum(np.abs(stretch - weighted_median(stretch, areas)), 2),
        # what the surfaces share is searched anew: what the samples of the wholes say does not count then
        unmatched=0.0 if missing > PARTIAL else unmatched_share(found.value, len(found.source_samples)),
    )
    return float(areas @ (probability(seen, bent=True) * shared) / areas.sum())


def _columns(
    constant: Floats, descriptors: Floats | float = 0.0, stretch: Floats | float = 0.0, *, unmatched: float
) -> Floats:
    """Return evidence as of `confidence.evidence`, (q, 8), of what is known of a map that is not bent."""
    result = np.zeros((len(constant), len(COLUMNS)))
    given = {"constant": constant, "descriptors": descriptors, "stretch": stretch, "unmatched samples": unmatched}
    for name, values in given.items():
        result[:, COLUMNS.index(name)] = values
    return result
