"""Tubes and rings, as sleeves and belts, of which either end may be the outer boundary: where the map is doubtful.

The longest boundary of each surface is taken for its outer one, and the others are closed. Of two ends about as long as
each other the longer one need not be the same on both surfaces.
"""

from __future__ import annotations

import numpy as np

from ...flatten.flatten import Flattening
from ...stages import Part
from ...surface.mesh import Floats, Integers
from ..result.alignment import Alignment
from ..surfaces.prepared import Surface
from ..surfaces.remark import Remark
from .otherwise import doubted, otherwise

ALIKE = 0.5
"""Length of a boundary, in those of the longest one, from which on either may be the outer one. The wrong one is the
longest where two ends of one thing are stretched that differently between the surfaces, and more than twice is rare."""


def with_other_rim(
    found: Alignment, source: Surface, target: Surface, clock: Part, landmarks: Integers | None
) -> tuple[Alignment, Surface, Surface] | None:
    """Return what comes of a doubtful map if one surface has another outer boundary; None where it is no better.

    That surface is the one the two longest boundaries of which are more alike.
    """
    if source.outer_vertex is not None or target.outer_vertex is not None or not doubted(found):
        return None
    alike, at = zip(*map(_second, (source, target)), strict=True)
    if max(alike) < ALIKE:
        return None
    part = clock.part(0.0, 1.0, "other end")
    part.begin("other end", "Trying the other end", 0.0)
    if alike[0] > alike[1]:
        changed = source = _with_outer(source, at[0])
    else:
        changed = target = _with_outer(target, at[1])
    other = otherwise(found, source, target, part, landmarks)
    if other is None:
        return None
    said = (
        f"'{changed.original.name}': another opening than the longest taken for its outer boundary, with which it fits "
        "better, for the computation only"
    )
    return other.annotated(remarks=(Remark("done", said), *other.remarks)), source, target


def _second(surface: Surface) -> tuple[float, int]:
    """Return how long the second longest boundary is, in lengths of the longest, and a vertex of it; 0 for none."""
    found = surface.flattening
    if not isinstance(found, Flattening) or not found.holes:
        return 0.0, -1
    lengths = [_length(found.mesh.vertices[loop]) for loop in found.holes]
    longest = int(np.argmax(lengths))
    return lengths[longest] / _length(found.mesh.vertices[found.boundary]), int(found.holes[longest][0])


def _length(loop: Floats) -> float:
    return float(np.linalg.norm(loop - np.roll(loop, 1, axis=0), axis=1).sum())


def _with_outer(surface: Surface, vertex: int) -> Surface:
    """Return the surface with another outer boundary, on which a vertex of the mesh in order is."""
    original = int(surface.cleaned.origin[vertex])
    return Surface(
        surface.original, fill_holes=surface.fill_holes, outer_vertex=original, keys=surface.keys, tidy=surface.cleaned
    )
