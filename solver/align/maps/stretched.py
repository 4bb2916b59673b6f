"""Whether what one surface seems to lack is missing, or the other only stretched there: what descriptors say."""

from __future__ import annotations

import numpy as np

from ...surface.barycentric import interpolated
from ...surface.mesh import Floats, Integers
from ..result.alignment import Alignment
from ..result.confidence import DOUBTFUL
from ..result.overlap import BEYOND

EITHER_WAY = 1.96
"""Standard errors up to which chance may reach: two-sided, 95 %, as either map may be the better one."""


def shows_what_is_missing(whole: Alignment) -> bool:
    """Return whether a map of the wholes shows anything of what is missing, as one that is doubtful does not."""
    return whole.mean_confidence > DOUBTFUL


def agrees_better(cut: Alignment, whole: Alignment) -> bool:
    """Return whether descriptors agree better, beyond chance, by the map of what is shared than by that of the wholes.

    Asked of the target's points that the two put in different places: the mean of the differences in its standard
    errors, of as many points as stand for that area in the search. A map of pieces is free where one of the wholes is
    held, so that it stretches less in any case, which does not count.
    """
    if not shows_what_is_missing(whole):
        return False
    source, target = whole.source, whole.target
    both = np.flatnonzero((cut.confidence > 0) & (whole.confidence > 0))
    one, two = (_places(found, both) for found in (cut, whole))
    moved = np.linalg.norm(one - two, axis=1) > BEYOND * np.sqrt(source.mesh.area)
    areas = target.mesh.vertex_areas[both[moved]]
    count = len(whole.source_samples) * areas.sum() / target.mesh.area
    if count < 1:
        return False
    gain = (_apart(whole, both) - _apart(cut, both))[moved]
    mean = gain @ areas / areas.sum()
    deviation = np.sqrt((gain - mean) ** 2 @ areas / areas.sum())
    return bool(mean * np.sqrt(count) > EITHER_WAY * deviation)


def _places(found: Alignment, vertices: Integers) -> Floats:
    """Return where target vertices, (q,), lie on the source, (q, 3)."""
    face, barycentric = found.located
    source = found.source.mesh
    return interpolated(source.vertices, source.faces[face[vertices]], barycentric[vertices])


def _apart(found: Alignment, vertices: Integers) -> Floats:
    """Return the difference of the descriptors, (q,), at target vertices, (q,): see `confidence.evidence`."""
    inner, own = found, vertices
    if found.overlap is not None:
        inner = found.overlap.alignment
        own = np.searchsorted(found.overlap.target.vertices, vertices)
    row = np.cumsum(inner.target.mesh.used) - 1
    return inner.evidence[row[own], 1]
